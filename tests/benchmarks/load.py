"""Other work on every core, as on a machine that others use: memory is streamed until it is told to end."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

NUMBERS = 1 << 24  # of each of two arrays: 128 MiB a process, beyond all caches


@contextmanager
def load(wanted: bool = True) -> Iterator[None]:
    """One process a core streams memory meanwhile; none if it is not wanted."""
    others = [subprocess.Popen([sys.executable, __file__]) for _ in range((os.cpu_count() or 1) * wanted)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def _stream() -> None:
    """Until the process that started this one is gone."""
    import numpy as np

    parent = os.getppid()
    a, b = np.ones((2, NUMBERS), np.float32)
    while os.getppid() == parent:
        np.multiply(a, np.float32(1.0001), out=b)
        np.add(b, a, out=a)
        np.minimum(a, np.float32(1), out=a)


if __name__ == "__main__":
    _stream()
