"""Semi-global matching (Hirschmueller 2008): costs aggregated along eight paths, the winner and its sub-pixel fit."""

from typing import Any

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, kernel, literal
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.room import Room
from matbench.algorithms.turning import EACH, turn_volume


@helper
def _contrast(a, b):  # type: ignore[no-untyped-def]
    """Largest difference of two pixels over their colours, in grey levels."""
    return max(
        abs(np.int64(a[0]) - np.int64(b[0])), abs(np.int64(a[1]) - np.int64(b[1])), abs(np.int64(a[2]) - np.int64(b[2]))
    )


@literal
def _round(values, scale, out):  # type: ignore[no-untyped-def]
    zero, half, kind = np.float32(0), np.float32(0.5), out.dtype.type
    for x in range(values.size):
        value = values[x]
        out[x] = kind(value * scale + half) if value == value else kind(zero)


@kernel
def _whole(cost, scale, out):  # type: ignore[no-untyped-def]
    """out = cost in whole units; 0 where it is unknown (NaN)."""
    columns = cost.shape[2]
    for y in range(cost.shape[0]):
        for k in range(cost.shape[1]):
            _round(cost[y, k], scale, out[y, k, :columns])
            fill(out.dtype.type(0), out[y, k, columns:])


@helper
def _extend(below, above, before, small, cap, floor, cost, path):  # type: ignore[no-untyped-def]
    """L(p, k) = C(p, k) + min(L(q, k +- 1) + P1, L(q, k), min L(q) + P2) - min L(q)."""
    kind = path.dtype.type
    for x in range(path.size):
        move = kind(min(below[x], above[x]) + small)
        path[x] = kind(kind(min(move, min(before[x], cap[x])) - floor[x]) + cost[x])


@helper
def _take(path, least, total):  # type: ignore[no-untyped-def]
    """What L(p, k) does to min L(p) and to the sum over the paths."""
    kind = path.dtype.type
    for x in range(path.size):
        value = path[x]
        least[x] = min(least[x], value)
        total[x] = kind(total[x] + value)


@helper
def _put(path, least, total):  # type: ignore[no-untyped-def]
    """The same for the first of the paths: `total` is overwritten."""
    for x in range(path.size):
        value = path[x]
        least[x] = min(least[x], value)
        total[x] = value


@kernel
def _sweep(cost, image, small, large, border, spread, forward, fresh, total):  # type: ignore[no-untyped-def]
    """The paths from the row before to the next one, added to `total`: down the columns and, for `spread` = 1, aslant.

    Backward, the rows are walked from the last to the first; `fresh` sums overwrite `total`.

    L(p, k) = C(p, k) + min(L(q, k), L(q, k +- 1) + P1, min L(q) + P2) - min L(q), in whole units.

    Parameters
    ----------
    cost
        (rows, planes, columns) of unsigned integers; rows and columns beyond the image are not read.
    border
        More than any L, and so much that `small` more is still a number of their kind.
    """
    # short loops over the columns, each over few arrays: so each becomes instructions for many columns at once
    (rows, columns, _), planes = image.shape, cost.shape[1]
    count, kind = 2 * spread + 1, cost.dtype.type
    # L of the row before and of this one, and min L: a column more on both sides, from where a path begins anew
    paths = np.zeros((count, 2, planes + 2, columns + 2), cost.dtype)
    paths[:, :, 0] = border  # before the first plane there is none, nor after the last
    paths[:, :, planes + 1] = border
    least = np.zeros((count, 2, columns + 2), cost.dtype)
    cap = np.zeros((count, columns), cost.dtype)
    for row in range(rows):
        y, y_old = (row, row - 1) if forward else (rows - 1 - row, rows - row)
        old, new = row % 2, 1 - row % 2
        for d in range(count):
            for x in range(columns):
                x_old = x + spread - d
                begins = row == 0 or x_old < 0 or x_old >= columns
                jump = kind(0) if begins else large[_contrast(image[y, x], image[y_old, x_old])]
                cap[d, x] = kind(least[d, old, x_old + 1] + jump)
            for x in range(columns):
                least[d, new, x + 1] = border
        for k in range(planes):
            for d in range(count):
                first = 1 + spread - d
                end, before = first + columns, paths[d, old]
                path = paths[d, new, k + 1, 1 : 1 + columns]
                _extend(
                    before[k, first:end], before[k + 2, first:end], before[k + 1, first:end], small, cap[d],
                    least[d, old, first:end], cost[y, k, :columns], path,
                )  # fmt: skip
                if fresh and d == 0:
                    _put(path, least[d, new, 1 : 1 + columns], total[y, k, :columns])
                else:
                    _take(path, least[d, new, 1 : 1 + columns], total[y, k, :columns])


def penalties(small: float, large: float, edge: float) -> NDArray[np.float32]:
    """(256,) P2 by contrast to the previous pixel: max(P1, P2 exp(-contrast / edge)), in grey levels."""
    return np.maximum(small, large * np.exp(-np.arange(256) / edge)).astype(np.float32)


COARSEST = 1000
"""Units that the largest cost is worth at least, as far as numbers allow it."""


def _units(top: float, table: NDArray[np.float32]) -> tuple[type[np.uint16 | np.uint32], float]:
    """The smallest kind of whole numbers for sums over eight paths, and how many of them make a cost of 1.

    A path costs at most the largest cost and the largest penalty, as min L(q) is subtracted at each step.
    """
    most = top + float(table.max())
    # a little less than what fits, for what rounding adds; 23 bits are what a cost in single precision has
    small, large = (((np.iinfo(kind).max >> 3) - 4) / most if most else 1.0 for kind in (np.uint16, np.uint32))
    if most == 0 or small * top >= COARSEST:
        return np.uint16, small
    return np.uint32, min(large, (1 << 23) / top) if top else large


def _add_paths(
    cost: NDArray[Any],
    image: NDArray[np.uint8],
    steps: tuple[Any, Any, Any],
    spread: int,
    total: NDArray[Any],
    fresh: bool,
    room: Room,
    threads: int,
) -> None:
    """Adds the paths forward and backward to `total`, each by a thread of its own if there are two.

    With `fresh` what stood there is overwritten.
    """
    if threads <= 1:
        _sweep(cost, image, *steps, spread, True, fresh, total)
        _sweep(cost, image, *steps, spread, False, False, total)
        return
    back = room.empty("back", total.shape, total.dtype)

    def sweep(first: int, _: int) -> None:
        _sweep(cost, image, *steps, spread, first == 0, fresh or first == 1, (total, back)[first])

    def add(top: int, end: int) -> None:
        np.add(total[top:end], back[top:end], out=total[top:end])

    over_rows(sweep, 2, threads, 1)
    over_rows(add, len(total), threads)


def aggregate(
    cost: NDArray[np.float32],
    image: NDArray[np.uint8],
    small: float,
    large: float,
    edge: float,
    threads: int = 1,
    room: Room | None = None,
    largest: float | None = None,
) -> tuple[NDArray[np.uint16] | NDArray[np.uint32], float]:
    """Sum of the path costs over eight directions, in whole units: many small numbers are added at once.

    Paths along the rows are paths down the columns of the turned picture.

    Parameters
    ----------
    cost
        (H, planes, W) float32, at least 0; NaN = unknown: it adds nothing to a path.
    image
        (H, W, 3) uint8; across its edges large steps cost less.
    small, large
        P1 for a step of one plane, P2 for any larger one, in units of the cost.
    edge
        Grey levels of contrast over which P2 falls to 1/e; it never falls below P1.
    room
        Where the arrays are taken from, the sums among them: the next sums from there overwrite these.
    largest
        The largest cost, if it is known.

    Returns
    -------
    sums
        (H, planes, W or up to three more) whole numbers, and anything in columns beyond W. The same for any number
        of threads.
    unit
        How many of them make a cost of 1: 4095 for costs up to 1 and a P2 of 1.
    """
    table = penalties(small, large, edge)
    kind, unit = _units(float(np.nanmax(cost, initial=0)) if largest is None else largest, table)
    border = np.iinfo(kind).max >> 1
    steps = kind(round(small * unit)), np.rint(table.astype(float) * unit).astype(kind), kind(border)
    rows, planes, columns = cost.shape
    room = room or Room()
    shape = -(-rows // EACH) * EACH, planes, -(-columns // EACH) * EACH
    whole, total = room.empty("whole", shape, kind), room.empty("total", shape, kind)
    over_rows(lambda top, end: _whole(cost[top:end], np.float32(unit), whole[top:end]), rows, threads)
    turned, along = room.empty("turned", shape[::-1], kind), room.empty("along", shape[::-1], kind)
    turn_volume(whole, turned, threads)
    turned_image = np.ascontiguousarray(image.transpose(1, 0, 2))
    _add_paths(turned, turned_image, steps, 0, along, True, room, threads)
    turn_volume(along, total, threads)
    _add_paths(whole, image, steps, 1, total, False, room, threads)
    return total[:rows], unit


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
def _energies(cost, image, planes, small, large):  # type: ignore[no-untyped-def]
    """(H,) sums of E over the pixels of each row: their own costs, and what they pay to four of their neighbours."""
    height, _, width = cost.shape
    found = np.zeros(height)
    for y in range(height):
        for x in range(width):
            k = planes[y, x]
            if k < 0:
                continue
            if cost[y, k, x] == cost[y, k, x]:
                found[y] += cost[y, k, x]
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
    contrast: float = field(default=12.0, validator=validators.gt(0))

    def infer(self, cost: NDArray[np.float32], image: NDArray[np.uint8], threads: int = 1) -> NDArray[np.float32]:
        """(H, W) plane index, to a fraction of a plane, of the least sum of path costs (`aggregate`, `winner`).

        Parameters
        ----------
        cost
            (H, planes, W); NaN = unknown: such a plane is never the answer.
        image
            (H, W, 3) uint8, the view whose rays the costs are on.

        Returns
        -------
        (H, W) float32, NaN where all costs are.
        """
        return self.infer_surely(cost, image, threads, surely=False)[0]

    def infer_surely(
        self,
        cost: NDArray[np.float32],
        image: NDArray[np.uint8],
        threads: int = 1,
        surely: bool = True,
        room: Room | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """The same, and (H, W) the `peak_ratio` of the sums of path costs, if it is asked for."""
        tops = np.zeros(len(cost), cost.dtype)
        over_rows(lambda top, end: np.copyto(tops[top:end], cost[top:end].max((1, 2), initial=0)), len(cost), threads)
        largest = float(tops.max(initial=0))
        complete = not np.isnan(largest)
        steps = self.small_step, self.large_step, self.contrast
        sums, _ = aggregate(cost, image, *steps, threads, room, largest if complete else None)
        found = np.empty(image.shape[:2], np.float32)

        def win(top: int, end: int) -> None:
            if complete:
                winner_of_known(sums[top:end], found[top:end])
            else:
                found[top:end] = winner(sums[top:end], cost[top:end])

        over_rows(win, len(found), threads, 64)
        return found, peak_ratio(sums, found, threads) if surely else None

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
