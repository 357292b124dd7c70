"""One cost for every pixel and plane of a view, from the similarities of several pairs (SPEC 8)."""

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import FULL, Features, Matcher, pairs


@helper
def _exchange(high, low):  # type: ignore[no-untyped-def]
    """Puts the larger of two numbers first, column by column."""
    for x in range(high.size):
        a, b = high[x], low[x]
        high[x], low[x] = max(a, b), min(a, b)


@helper
def _sum_first(part, place, taken, total):  # type: ignore[no-untyped-def]
    """Adds the number of rank `place` in the columns that take more than so many."""
    zero = np.float32(0)
    for x in range(total.size):
        total[x] += np.float32(part[x]) if place < taken[x] else zero


@kernel
def better_half(rho, low, high, mean):  # type: ignore[no-untyped-def]
    """Mean of the better half, rounded up, of the similarities with both frusta; 0 where there is none.

    Where half of the views cannot see a point, the other half still can.

    Parameters
    ----------
    rho
        (rows, pairs, planes, columns) uint8 in 255ths.
    low, high
        (pairs, planes) the first column that both views of a pair see, and the one after the last.
    mean
        (rows, planes, columns) float32 in [0, 1], overwritten.
    """
    count, columns = rho.shape[1], rho.shape[3]
    best = np.empty((count, columns), np.uint8)
    taken = np.empty(columns, np.int32)
    scale = np.float32(1 / FULL)
    for k in range(rho.shape[2]):
        taken[:] = 0
        for p in range(count):
            for x in range(low[p, k], high[p, k]):
                taken[x] += 1
        for x in range(columns):
            taken[x] = (taken[x] + 1) // 2
        for y in range(rho.shape[0]):
            for p in range(count):
                for x in range(columns):
                    best[p, x] = rho[y, p, k, x]
            total = mean[y, k]
            total[:] = 0
            for place in range((count + 1) // 2):  # sorts no further than the sum needs
                for p in range(count - 1, place, -1):
                    _exchange(best[p - 1], best[p])
                _sum_first(best[place], place, taken, total)
            for x in range(columns):
                total[x] *= scale / np.float32(max(taken[x], 1))


def view_cost(matcher: Matcher, threads: int = 1, phases: Features | None = None) -> NDArray[np.float32]:
    """(H, W, planes) 1 - mean of the better half of rho on the reference view's pixel rays.

    NaN where no pair has both frusta. Similarities are computed by blocks of rows and not kept.
    `phases`, if given, are those of the matcher.
    """
    space = matcher.space
    features = matcher.phases() if phases is None else phases
    spans = np.stack([matcher.ray_spans(i, j) for i, j in matcher.pairs])
    low, high = spans[..., 0].copy(), spans[..., 0] + spans[..., 1]
    columns = np.arange(space.width)[:, None, None]
    unknown = ~((low <= columns) & (columns < high)).any(axis=1)
    cost = np.empty((space.rows, space.width, space.planes), np.float32)

    def fill(first: int, end: int) -> None:
        mean = np.empty((end - first, space.planes, space.width), np.float32)
        better_half(matcher.rays(features, first, end), low, high, mean)
        np.subtract(1, mean.transpose(0, 2, 1), out=cost[first:end])
        cost[first:end, unknown] = np.nan

    over_rows(fill, space.rows, threads)
    return cost


def seen_from(matcher: Matcher, view: int) -> Matcher:
    """The same views matched from one of them: it is the reference, and part of every pair."""
    scene = evolve(matcher.scene, ref=view, regions={})
    return evolve(matcher, scene=scene, pairs=pairs(matcher.space.views, "reference", view))
