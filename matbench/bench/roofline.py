"""The limits of the machine on one thread: memory bandwidth and arithmetic, by the usual benchmarks."""

import time

import numpy as np
from attrs import frozen
from numba import njit

_TRIAD = 1 << 23  # numbers: three arrays of 32 MiB, beyond most caches, so that memory is measured
_TERMS, _ROWS = 32, 2000
# "contract" makes one instruction of a multiply and an add; without it the machine would seem half as fast
_compiled = njit(nogil=True, fastmath={"contract", "reassoc", "nsz"})


@frozen
class Roofline:
    """The best of several measurements on one thread.

    Parameters
    ----------
    bandwidth
        Gigabytes a second of the STREAM triad a = b + s c, float32, 12 bytes an element
        (J. McCalpin, "STREAM: sustainable memory bandwidth in high performance computers").
    arithmetic
        Thousand million float32 operations a second of a polynomial of degree 32 by Horner's rule
        on numbers in the first-level cache: multiply-adds, two operations each.
    """

    bandwidth: float
    arithmetic: float

    def best(self, other: "Roofline") -> "Roofline":
        """The higher limits of both: disturbances only lower what is measured."""
        return Roofline(max(self.bandwidth, other.bandwidth), max(self.arithmetic, other.arithmetic))


@_compiled
def _triad(a, b, c, s):  # type: ignore[no-untyped-def]
    for x in range(a.size):
        a[x] = b[x] + s * c[x]


@_compiled
def _horner(x, factors, times):  # type: ignore[no-untyped-def]
    for _ in range(times):
        for i in range(x.size):
            here = x[i]
            total = factors[0]
            for k in range(1, 33):
                total = total * here + factors[k]
            x[i] = total


def measure(repeats: int = 5) -> Roofline:
    """Measure both limits; the best of `repeats` tries."""
    a, b, c = np.ones((3, _TRIAD), np.float32)
    x, factors = np.full(1024, 0.5, np.float32), np.full(_TERMS + 1, 0.25, np.float32)
    _triad(a, b, c, np.float32(0.5))
    _horner(x, factors, 1)
    triad = horner = np.inf
    for _ in range(repeats):
        begin = time.thread_time()
        _triad(a, b, c, np.float32(0.5))
        middle = time.thread_time()
        _horner(x, factors, _ROWS)
        triad, horner = min(triad, middle - begin), min(horner, time.thread_time() - middle)
    return Roofline(12 * _TRIAD / triad / 1e9, 2 * _TERMS * x.size * _ROWS / horner / 1e9)
