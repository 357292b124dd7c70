"""Semi-global matching (Hirschmueller 2008): costs aggregated along eight paths, the winner and its sub-pixel fit."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel


@helper
def _least(values):  # type: ignore[no-untyped-def]
    """The least of some numbers, none NaN."""
    # four minima at once: in a single chain every step would wait for the one before
    a = b = c = d = values[0]
    whole = values.size - values.size % 4
    for k in range(0, whole, 4):
        a, b = min(a, values[k]), min(b, values[k + 1])
        c, d = min(c, values[k + 2]), min(d, values[k + 3])
    for k in range(whole, values.size):
        a = min(a, values[k])
    return min(min(a, b), min(c, d))


@helper
def _extend(cost, below, before, above, floor, small, large, path, total):  # type: ignore[no-untyped-def]
    """L(p, k) = C(p, k) + min(L(q, k), L(q, k +- 1) + P1, min L(q) + P2) - min L(q), added to the total.

    `below`, `before`, `above` are L(q, .) at k - 1, k, k + 1. An unknown (NaN) cost adds nothing.
    """
    zero = np.float32(0)
    cap = floor + large
    for k in range(cost.size):
        known = cost[k] if cost[k] == cost[k] else zero
        move = min(min(below[k], above[k]) + small, min(before[k], cap)) - floor
        path[k] = known + move
        total[k] += path[k]


@helper
def _contrast(a, b):  # type: ignore[no-untyped-def]
    """Largest difference of two pixels over their colours, in grey levels."""
    return max(
        abs(np.int64(a[0]) - np.int64(b[0])), abs(np.int64(a[1]) - np.int64(b[1])), abs(np.int64(a[2]) - np.int64(b[2]))
    )


@kernel
def _sweep(cost, image, small, large, forward, total):  # type: ignore[no-untyped-def]
    """Four of the eight paths: from the previous pixel of the row and the three in the previous row.

    Backward, the image is walked from its last pixel to its first.
    """
    height, width, planes = cost.shape
    border = np.float32(np.inf)
    # path costs L of the previous and this row, and of the previous pixel, with borders around the planes
    old = np.full((3, width, planes + 2), border, np.float32)
    new = np.full((3, width, planes + 2), border, np.float32)
    old_least = np.zeros((3, width), np.float32)
    new_least = np.zeros((3, width), np.float32)
    run = np.full((2, planes + 2), border, np.float32)
    run_least = np.float32(0)
    free = np.zeros(planes + 2, np.float32)
    zero = np.float32(0)
    ahead = 1 if forward else -1
    for row in range(height):
        y = row if forward else height - 1 - row
        for place in range(width):
            x = place if forward else width - 1 - place
            here, out = cost[y, x], total[y, x]
            path = run[place % 2]
            if place == 0:
                _extend(here, free[:-2], free[1:-1], free[2:], zero, small, zero, path[1:-1], out)
            else:
                last = run[(place + 1) % 2]
                penalty = large[_contrast(image[y, x], image[y, x - ahead])]
                _extend(here, last[:-2], last[1:-1], last[2:], run_least, small, penalty, path[1:-1], out)
            run_least = _least(path[1:-1])
            for d in range(3):
                x_old, y_old = x - ahead * (d - 1), y - ahead
                path = new[d, x]
                if row == 0 or x_old < 0 or x_old >= width:
                    _extend(here, free[:-2], free[1:-1], free[2:], zero, small, zero, path[1:-1], out)
                else:
                    last = old[d, x_old]
                    penalty = large[_contrast(image[y, x], image[y_old, x_old])]
                    _extend(here, last[:-2], last[1:-1], last[2:], old_least[d, x_old], small, penalty, path[1:-1], out)
                new_least[d, x] = _least(path[1:-1])
        old, new = new, old
        old_least, new_least = new_least, old_least


def penalties(small: float, large: float, edge: float) -> NDArray[np.float32]:
    """(256,) P2 by contrast to the previous pixel: max(P1, P2 exp(-contrast / edge)), in grey levels."""
    return np.maximum(small, large * np.exp(-np.arange(256) / edge)).astype(np.float32)


def aggregate(
    cost: NDArray[np.float32], image: NDArray[np.uint8], small: float, large: float, edge: float, threads: int = 1
) -> NDArray[np.float32]:
    """Sum of the path costs over eight directions.

    Parameters
    ----------
    cost
        (H, W, K) float32; NaN = unknown: it adds nothing to a path.
    image
        (H, W, 3) uint8; across its edges large steps cost less.
    small, large
        P1 for a step of one plane, P2 for any larger one, in units of the cost.
    edge
        Grey levels of contrast over which P2 falls to 1/e; it never falls below P1.

    Returns
    -------
    (H, W, K) float32, free of NaN. The same for any number of threads.
    """
    table = penalties(small, large, edge)
    totals = np.zeros((2, *cost.shape), np.float32)

    def sweep(forward: bool) -> None:
        _sweep(cost, image, np.float32(small), table, forward, totals[0 if forward else 1])

    if threads > 1:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(sweep, (True, False)))
    else:
        sweep(True)
        sweep(False)
    total: NDArray[np.float32] = np.add(totals[0], totals[1], out=totals[0])
    return total


@kernel
def winner(total, cost):  # type: ignore[no-untyped-def]
    """(H, W) float32 plane index of the least total, to a fraction of a plane by the equiangular fit.

    A plane whose own cost is NaN cannot win; the answer is NaN where all costs are. With the totals S at the
    winner k and beside it, the fraction is ``(S[k-1] - S[k+1]) / (2 (max(S[k-1], S[k+1]) - S[k]))``. There is
    no fraction at the ends of the range, beside an unknown plane, or if S is less beside k.
    """
    height, width, planes = total.shape
    found = np.empty((height, width), np.float32)
    for y in range(height):
        for x in range(width):
            sums, known = total[y, x], cost[y, x]
            best = -1
            for k in range(planes):
                if known[k] == known[k] and (best < 0 or sums[k] < sums[best]):
                    best = k
            found[y, x] = best if best >= 0 else np.nan
            if 0 < best < planes - 1 and not np.isnan(known[best - 1]) and not np.isnan(known[best + 1]):
                below, here, above = sums[best - 1], sums[best], sums[best + 1]
                drop = max(below, above) - here
                if drop > 0 and here <= min(below, above):
                    found[y, x] += (below - above) / (drop + drop)
    return found


@kernel
def _energies(cost, image, planes, small, large):  # type: ignore[no-untyped-def]
    """(H,) sums of E over the pixels of each row: their own costs, and what they pay to four of their neighbours."""
    height, width, _ = cost.shape
    found = np.zeros(height)
    for y in range(height):
        for x in range(width):
            k = planes[y, x]
            if k < 0:
                continue
            if cost[y, x, k] == cost[y, x, k]:
                found[y] += cost[y, x, k]
            for d in range(4):  # the pixel before, and the three of the row before: each pair of neighbours once
                x_old, y_old = (x - 1, y) if d == 3 else (x + d - 1, y - 1)
                if x_old < 0 or x_old >= width or y_old < 0 or planes[y_old, x_old] < 0:
                    continue
                step = abs(k - planes[y_old, x_old])
                if step == 1:
                    found[y] += small
                elif step > 1:
                    found[y] += large[_contrast(image[y, x], image[y_old, x_old])]
    return found


@frozen
class SemiGlobal:
    """Disparities from costs in [0, 1] by semi-global matching.

    Parameters
    ----------
    small_step
        P1, the cost of a step of one plane between neighbouring pixels.
    large_step
        P2, the cost of any larger step where the reference image is flat.
    contrast
        Grey levels (largest over the colours) over which P2 falls to 1/e; never below P1.
    """

    small_step: float = field(default=0.2, validator=validators.ge(0))
    large_step: float = field(default=1.0, validator=validators.ge(0))
    contrast: float = field(default=25.0, validator=validators.gt(0))

    def infer(self, cost: NDArray[np.float32], image: NDArray[np.uint8], threads: int = 1) -> NDArray[np.float32]:
        """(H, W) plane index, to a fraction of a plane, of the least sum of path costs (`aggregate`, `winner`).

        Parameters
        ----------
        cost
            (H, W, K); NaN = unknown: such a plane is never the answer.
        image
            (H, W, 3) uint8, the view whose rays the costs are on.

        Returns
        -------
        (H, W) float32, NaN where all costs are.
        """
        return np.asarray(winner(self.sums(cost, image, threads), cost))

    def energy(self, cost: NDArray[np.float32], image: NDArray[np.uint8], planes: NDArray[np.float32]) -> float:
        """The energy of a map per pixel (Hirschmueller 2008, equation 3); `infer` seeks the map of least energy.

        E = sum over pixels of cost(p, D_p) + sum over neighbours, eight around a pixel and each pair once,
        of P1 where their planes differ by one and of P2 where they differ by more.

        Parameters
        ----------
        cost, image
            As for `infer`.
        planes
            (H, W) plane indices, rounded to whole ones; a pixel without an answer (NaN) pays nothing.
        """
        whole = np.nan_to_num(np.rint(planes), nan=-1).astype(np.int64)
        large = penalties(self.small_step, self.large_step, self.contrast)
        return float(_energies(cost, image, whole, np.float32(self.small_step), large).sum() / planes.size)

    def sums(self, cost: NDArray[np.float32], image: NDArray[np.uint8], threads: int = 1) -> NDArray[np.float32]:
        """(H, W, K) path costs, summed over the eight directions; see `aggregate`."""
        return aggregate(cost, image, self.small_step, self.large_step, self.contrast, threads)
