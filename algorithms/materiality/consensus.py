"""The materialities on which the maps of all views agree (equations 13 and 14)."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.agreement import ENDED, PRIOR
from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows
from matbench.space import DisparitySpace


@helper
def _add_between(values, fineness, phase, out):  # type: ignore[no-untyped-def]
    """Adds to every `fineness`-th number of `out`, from `phase` on, a row of pixels interpolated at that phase."""
    share = np.float32(phase / fineness)
    rest = np.float32(1) - share
    if phase == 0:
        for x in range(values.size):
            out[x * fineness] += values[x]
    else:
        for x in range(values.size - 1):
            out[x * fineness + phase] += rest * values[x] + share * values[x + 1]


@kernel
def add_view(found, view, first, origin, fineness, top, end, ended, reached):  # type: ignore[no-untyped-def]
    """Adds w of one view to `ended` and its V to `reached`, for rows top..end (see `consensus`).

    Parameters
    ----------
    found
        (H, W) float32 plane in which the ray of every pixel of that view ends.
    view, first, origin, fineness
        Index of the view, and the space's numbers of that name.
    ended, reached
        (rows, planes, columns) float32, both added to.
    """
    width, planes = found.shape[1], ended.shape[1]
    ends, open_ = np.empty(width, np.float32), np.empty(width, np.float32)
    zero, one, two = np.float32(0), np.float32(1), np.float32(2)
    for y in range(top, end):
        for k in range(planes):
            for x in range(width):
                behind = np.float32(k) - found[y, x]
                ends[x] = max(one - abs(behind), zero)
                open_[x] = min(max(behind + two, zero), one)
            start = view * (first + k) - origin
            for phase in range(fineness):
                _add_between(ends, fineness, phase, ended[y, k, start:])
                _add_between(open_, fineness, phase, reached[y, k, start:])


def consensus(space: DisparitySpace, maps: NDArray[np.float32], threads: int = 1) -> NDArray[np.float32]:
    """(rows, planes, columns) float32: the share of the rays reaching a point that end there.

    mu = (sum over i w_i + 0.05) / (sum over i V_i + 0.5), with w_i and V_i as in `Fusion.seen_cost`. Between
    the pixels of a row both are interpolated linearly.

    Parameters
    ----------
    maps
        (views, H, W) float32 planes of the space in which the rays end, fractions included, no NaN.
    """
    ended = np.full(space.shape, ENDED, np.float32)
    reached = np.full(space.shape, PRIOR, np.float32)
    for view, found in enumerate(maps):

        def add(top: int, end: int, view: int = view, found: NDArray[np.float32] = found) -> None:
            add_view(found, view, space.first, space.origin, space.fineness, top, end, ended, reached)

        over_rows(add, space.rows, threads)
    ended /= reached
    return np.minimum(ended, 1, out=ended)
