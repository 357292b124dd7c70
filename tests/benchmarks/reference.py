"""The frozen reference workload: what every subject's time is divided by. It must never change.

A stored ratio means something only while its divisor, and what is divided, are the same: so a digest of these
files stands in every stored baseline, and a baseline of another digest is not judged by.
"""

from hashlib import sha256
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray

WIDE, NARROW = (24, 32, 128), (2, 12, 128)  # two volumes of 384 KiB, and two of 12 KiB
TIMES = 50  # sweeps of the narrow ones for one of the wide ones: about half of the time each
_compiled = njit(nogil=True, cache=True, fastmath={"contract", "reassoc", "nsz"})


@_compiled
def _relax(here, beside, weight, into):  # type: ignore[no-untyped-def]
    """Products, minima and sums of neighbouring planes, as in the methods' innermost loops; the sum of `into`."""
    total, one, zero = np.float32(0), np.float32(1), np.float32(0)
    for x in range(here.size):
        gap = here[x] - beside[x]
        into[x] = min(max(into[x] + weight * (gap * gap + min(here[x], beside[x]) - into[x]), zero), one)
        total += into[x]
    return total


@_compiled
def _sweep(volume, other, weight):  # type: ignore[no-untyped-def]
    """One streaming pass over two volumes, of which it overwrites one."""
    rows, planes, _ = volume.shape
    total = np.float32(0)
    for y in range(rows):
        for k in range(1, planes):
            total += _relax(volume[y, k], volume[y, k - 1], weight, other[y, k])
    return total


class Reference:
    """The workload with its arrays; a call is always the same work, a tenth of a millisecond.

    Half of it streams from the second-level cache, half computes in the first, as the methods do both:
    other programs slow the one more or the other, and with both the ratios vary least.
    """

    def __init__(self) -> None:
        draw = np.random.default_rng(0)
        self._wide: NDArray[np.float32] = draw.random(WIDE, np.float32)
        self._narrow: NDArray[np.float32] = draw.random(NARROW, np.float32)
        self._others = np.zeros_like(self._wide), np.zeros_like(self._narrow)

    def __call__(self, times: int = 1) -> None:
        """Run it so many times."""
        for _ in range(times):
            _sweep(self._wide, self._others[0], np.float32(0.5))
            for _ in range(TIMES):
                _sweep(self._narrow, self._others[1], np.float32(0.5))


def digest() -> str:
    """SHA-256 of this file and of what times which subjects."""
    files = (Path(__file__).with_name(name) for name in ("reference.py", "paired.py", "subjects.py"))
    return sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()
