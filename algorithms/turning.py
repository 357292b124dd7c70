"""Turning volumes: rows become columns, four 16-bit numbers at a time."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows

EACH, _BAND = 4, 128  # numbers in a word; rows that are turned together, so that lines of the cache are filled
_EVEN, _FIRST = np.uint64(0x0000FFFF0000FFFF), np.uint64(0x00000000FFFFFFFF)
_ONE, _TWO = np.uint64(16), np.uint64(32)


@helper
def _turn_rows(rows, out):  # type: ignore[no-untyped-def]
    """Turns squares of four by four 16-bit numbers, of which four rows are four words."""
    for y in range(rows.shape[0] // EACH):
        r0, r1, r2, r3 = rows[EACH * y], rows[EACH * y + 1], rows[EACH * y + 2], rows[EACH * y + 3]
        for x in range(rows.shape[1]):
            a, b, c, d = r0[x], r1[x], r2[x], r3[x]
            top_even, top_odd = (a & _EVEN) | ((b & _EVEN) << _ONE), ((a >> _ONE) & _EVEN) | (b & ~_EVEN)
            low_even, low_odd = (c & _EVEN) | ((d & _EVEN) << _ONE), ((c >> _ONE) & _EVEN) | (d & ~_EVEN)
            out[EACH * x, y] = (top_even & _FIRST) | (low_even << _TWO)
            out[EACH * x + 1, y] = (top_odd & _FIRST) | (low_odd << _TWO)
            out[EACH * x + 2, y] = (top_even >> _TWO) | (low_even & ~_FIRST)
            out[EACH * x + 3, y] = (top_odd >> _TWO) | (low_odd & ~_FIRST)


@kernel
def _turn(volume, first, end, out):  # type: ignore[no-untyped-def]
    """Turns some planes of (rows, planes, columns) volumes of 16-bit numbers, given as words."""
    rows = volume.shape[0]
    for top in range(0, rows, _BAND):
        bottom = min(rows, top + _BAND)
        for k in range(first, end):
            _turn_rows(volume[top:bottom, k], out[:, k, top // EACH : bottom // EACH])


def turn_volume(volume: NDArray[Any], out: NDArray[Any], threads: int) -> None:
    """out (columns, planes, rows) = a volume (rows, planes, columns) of the turned picture.

    Both are of one kind of whole numbers. Rows and columns are multiples of `EACH`. The same for any number of threads.
    """
    if volume.itemsize == 2:
        words, turned = volume.view(np.uint64), out.view(np.uint64)
        over_rows(lambda first, end: _turn(words, first, end, turned), volume.shape[1], threads)
    else:
        np.copyto(out, volume.T)
