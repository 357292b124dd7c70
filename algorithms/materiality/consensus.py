"""Where the descent may start: from what the readers of all views agree on (SPEC 8)."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.fusion import seen_from, view_cost
from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.semiglobal import SemiGlobal
from matbench.algorithms.similarity import Matcher

ENDED, REACHED = 0.025, 0.25  # what a point that no view reaches has in the two sums
SLACK = 2  # planes between a surface and the first point that it hides


@helper
def _shares(total, sharpness, ends):  # type: ignore[no-untyped-def]
    """ends = exp(-sharpness total), normalised over the planes of a pixel; unknown totals are infinite."""
    least, weight = total[0], sharpness - sharpness
    for k in range(total.size):
        least = min(least, total[k])
    for k in range(total.size):
        ends[k] = np.exp(sharpness * (least - total[k])) if total[k] < np.inf else sharpness - sharpness
        weight += ends[k]
    if weight > 0:
        for k in range(total.size):
            ends[k] /= weight


@helper
def _add_between(values, fineness, phase, out):  # type: ignore[no-untyped-def]
    """Adds the linear interpolation of a row of pixels at one phase between them, from `out[phase]` on."""
    share = np.float32(phase / fineness)
    rest = np.float32(1) - share
    if phase == 0:
        for x in range(values.size):
            out[x * fineness] += values[x]
    else:
        for x in range(values.size - 1):
            out[x * fineness + phase] += rest * values[x] + share * values[x + 1]


@kernel
def add_view(total, sharpness, view, first, origin, fineness, top, end, ended, reached):  # type: ignore[no-untyped-def]
    """Adds w of one view to `ended` and its V to `reached`, for rows top..end (see `consensus`)."""
    _, width, planes = total.shape
    ends, open_ = np.empty((planes, width), np.float32), np.empty((planes, width), np.float32)
    ray = np.empty(planes, np.float32)
    zero, one = np.float32(0), np.float32(1)
    for y in range(top, end):
        for x in range(width):
            _shares(total[y, x], sharpness, ray)
            through = one
            for k in range(planes - 1, -1, -1):
                if k + SLACK < planes:
                    through -= ray[k + SLACK]
                ends[k, x], open_[k, x] = ray[k], max(through, zero)
        for k in range(planes):
            start = view * (first + k) - origin
            for phase in range(fineness):
                _add_between(ends[k], fineness, phase, ended[y, k, start:])
                _add_between(open_[k], fineness, phase, reached[y, k, start:])


def consensus(matcher: Matcher, reader: SemiGlobal, sharpness: float, threads: int = 1) -> NDArray[np.float32]:
    """(rows, planes, columns) float32 materialities that the maps of all views agree on.

    Every view i is read as the control reads the reference: with S the sum of its path costs over
    the eight directions, w_i(k) = exp(-sharpness S / 8), normalised along the ray, says where the
    ray ends, and V_i(k) = 1 - sum of w_i(k') over k' > k + 1 what it reaches. Then
    mu = (sum over i w_i + 0.025) / (sum over i V_i + 0.25). Between pixels w and V are linear.
    """
    space = matcher.space
    ended = np.full(space.shape, ENDED, np.float32)
    reached = np.full(space.shape, REACHED, np.float32)
    phases = matcher.phases()
    for view in range(space.views):
        seen = seen_from(matcher, view)
        cost = view_cost(seen, threads, phases)
        total = reader.sums(cost, seen.scene.views[view], threads)
        total[np.isnan(cost)] = np.inf

        def add(top: int, end: int, view: int = view, total: NDArray[np.float32] = total) -> None:
            add_view(
                total, np.float32(sharpness / 8), view, space.first, space.origin, space.fineness, top, end, ended,
                reached,
            )  # fmt: skip

        over_rows(add, space.rows, threads)
    ended /= reached
    return np.minimum(ended, 1, out=ended)
