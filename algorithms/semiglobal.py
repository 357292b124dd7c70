"""Semi-global matching (Hirschmueller 2008): the winner of the sums over eight paths, its sub-pixel fit, the energy."""

from typing import Any

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.paths import Paths, contrast, penalties
from matbench.algorithms.paths import aggregate as aggregate
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.room import Room


@helper
def _lesser_known(values, known, k, least, best):  # type: ignore[no-untyped-def]
    # all is read before anything is decided, here and below: else one column would be taken at a time
    plane = np.float32(k)
    for x in range(known.size):
        value, cost, before, place = np.float32(values[x]), known[x], least[x], best[x]
        better = cost == cost and value < before
        best[x] = plane if better else place
        least[x] = value if better else before


@helper
def _lesser(values, k, least, best):  # type: ignore[no-untyped-def]
    plane = least.dtype.type(k)
    for x in range(least.size):
        value, before, place = values[x], least[x], best[x]
        best[x] = plane if value < before else place
        least[x] = min(value, before)


@helper
def _fraction(below, here, above):  # type: ignore[no-untyped-def]
    """Of a plane, by the equiangular fit; 0 where `here` is not the least, or all are the same."""
    drop = max(below, above) - here
    return (below - above) / (drop + drop) if drop > 0 and here <= min(below, above) else np.float32(0)


@kernel
def winner(total, cost):  # type: ignore[no-untyped-def]
    """(H, W) float32 plane index of the least total, to a fraction of a plane by the equiangular fit.

    A plane whose own cost is NaN cannot win; the answer is NaN where all costs are. With the totals S at the
    winner k and beside it, the fraction is ``(S[k-1] - S[k+1]) / (2 (max(S[k-1], S[k+1]) - S[k]))``. There is
    no fraction at the ends of the range, beside an unknown plane, or if S is less beside k. Both volumes are
    (H, planes, W).
    """
    height, planes, width = cost.shape
    found, least = np.empty((height, width), np.float32), np.empty(width, np.float32)
    for y in range(height):
        sums, known, answers = total[y], cost[y], found[y]
        fill(np.float32(np.nan), answers)
        fill(np.float32(np.inf), least)
        for k in range(planes):
            _lesser_known(sums[k], known[k], k, least, answers)
        for x in range(width):
            if not 0 < answers[x] < planes - 1:
                continue
            best = int(answers[x])
            if not np.isnan(known[best - 1, x]) and not np.isnan(known[best + 1, x]):
                answers[x] += _fraction(np.float32(sums[best - 1, x]), least[x], np.float32(sums[best + 1, x]))
    return found


@kernel
def winner_of_known(total, found):  # type: ignore[no-untyped-def]
    """The same where all costs are known: found (H, W) float32, overwritten, from whole numbers (H, planes, W)."""
    planes, width = total.shape[1], found.shape[1]
    best, least = np.empty(width, total.dtype), np.empty(width, total.dtype)
    for y in range(found.shape[0]):
        sums = total[y]
        fill(total.dtype.type(0), best)
        for x in range(width):
            least[x] = sums[0, x]
        for k in range(1, planes):
            _lesser(sums[k], k, least, best)
        for x in range(width):
            won = int(best[x])
            found[y, x] = np.float32(won)
            if 0 < won < planes - 1:
                below, above = np.float32(sums[won - 1, x]), np.float32(sums[won + 1, x])
                found[y, x] += _fraction(below, np.float32(least[x]), above)


@kernel
def _energies(cost, unit, image, planes, small, large, top, end, found):  # type: ignore[no-untyped-def]
    """Sums of E over the pixels of rows top..end: their own costs, and what they pay to four of their neighbours."""
    width = planes.shape[1]
    for y in range(top, end):
        own, paid = np.float64(0), np.float64(0)
        for x in range(width):
            k = planes[y, x]
            if k < 0:
                continue
            if cost[y, k, x] == cost[y, k, x]:
                own += cost[y, k, x]
            for d in range(4):  # the pixel before, and the three of the row before: each pair of neighbours once
                x_old, y_old = (x - 1, y) if d == 3 else (x + d - 1, y - 1)
                if x_old < 0 or x_old >= width or y_old < 0 or planes[y_old, x_old] < 0:
                    continue
                step = abs(k - planes[y_old, x_old])
                if step == 1:
                    paid += small
                elif step > 1:
                    paid += large[contrast(image[y, x], image[y_old, x_old])]
        found[y] = own / unit + paid


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
    contrast: float = field(default=12.0, validator=validators.gt(0))

    def paths(self, largest: float) -> Paths:
        """How costs up to the `largest` are counted in whole numbers."""
        return Paths.of(self.small_step, self.large_step, self.contrast, largest)

    def infer(
        self, cost: NDArray[np.float32], image: NDArray[np.uint8], threads: int = 1, largest: float | None = None
    ) -> NDArray[np.float32]:
        """(H, W) plane index, to a fraction of a plane, of the least sum of path costs (`aggregate`, `winner`).

        Parameters
        ----------
        cost
            (H, planes, W); NaN = unknown: such a plane is never the answer.
        image
            (H, W, 3) uint8, the view whose rays the costs are on.
        largest
            No cost is more, if that is known.

        Returns
        -------
        (H, W) float32, NaN where all costs are.
        """
        tops = np.zeros(len(cost), cost.dtype)
        over_rows(lambda top, end: np.copyto(tops[top:end], cost[top:end].max((1, 2), initial=0)), len(cost), threads)
        complete = not np.isnan(tops.max(initial=0))
        if largest is None:
            largest = float(tops.max() if complete else np.nanmax(cost, initial=0))
        paths, room = self.paths(largest), Room()
        whole = paths.whole(cost, room, threads)
        if complete:
            return self.infer_whole(whole, paths, image, room, threads, surely=False)[0]
        sums, found = paths.sums(whole, image, room, threads), np.empty(image.shape[:2], np.float32)

        def win(top: int, end: int) -> None:
            found[top:end] = winner(sums[top:end], cost[top:end])

        over_rows(win, len(found), threads, 64)
        return found

    @staticmethod
    def infer_whole(
        whole: NDArray[Any],
        paths: Paths,
        image: NDArray[np.uint8],
        room: Room,
        threads: int = 1,
        surely: bool = True,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """The same from costs in whole units (`Paths.whole`), and (H, W) the `peak_ratio` of the sums if it is asked.

        The sums are taken from the `room`.
        """
        sums = paths.sums(whole, image, room, threads)
        found = np.empty(image.shape[:2], np.float32)
        over_rows(lambda top, end: winner_of_known(sums[top:end], found[top:end]), len(found), threads, 64)
        return found, peak_ratio(sums, found, threads) if surely else None

    def energy(
        self,
        cost: NDArray[Any],
        image: NDArray[np.uint8],
        planes: NDArray[np.float32],
        unit: float = 1.0,
        threads: int = 1,
    ) -> float:
        """The energy of a map per pixel (Hirschmueller 2008, equation 3); `infer` seeks the map of least energy.

        E = sum over pixels of cost(p, D_p) + sum over neighbours, eight around a pixel and each pair once,
        of P1 where their planes differ by one and of P2 where they differ by more.

        Parameters
        ----------
        cost, image
            As for `infer`, or costs in whole units.
        planes
            (H, W) plane indices, rounded to whole ones; a pixel without an answer (NaN) pays nothing.
        unit
            What a cost of 1 is.
        """
        whole, found = np.empty(planes.shape, np.int32), np.empty(len(planes))
        large = penalties(self.small_step, self.large_step, self.contrast)

        def round_rows(top: int, end: int) -> None:
            whole[top:end] = np.nan_to_num(np.rint(planes[top:end]), nan=-1)

        def pay(top: int, end: int) -> None:
            _energies(cost, unit, image, whole, np.float32(self.small_step), large, top, end, found)

        over_rows(round_rows, len(planes), threads)
        over_rows(pay, len(planes), threads)
        return float(found.sum() / planes.size)
