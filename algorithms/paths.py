"""Costs in whole numbers, and their sums over eight paths of semi-global matching (Hirschmueller 2008)."""

from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel, literal
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.room import Room
from matbench.algorithms.turning import EACH, turn_volume

BAND = 128  # rows of which the paths along the rows are summed at a time


@helper
def contrast(a, b):  # type: ignore[no-untyped-def]
    """Largest difference of two pixels over their colours, in grey levels."""
    return max(
        abs(np.int64(a[0]) - np.int64(b[0])), abs(np.int64(a[1]) - np.int64(b[1])), abs(np.int64(a[2]) - np.int64(b[2]))
    )


@literal
def round_costs(values, unit, out):  # type: ignore[no-untyped-def]
    """out = values in whole units; 0 where they are unknown (NaN)."""
    zero, half, kind = np.float32(0), np.float32(0.5), out.dtype.type
    for x in range(values.size):
        value = values[x]
        out[x] = kind(value * unit + half) if value == value else kind(zero)


@kernel
def _whole(cost, unit, out):  # type: ignore[no-untyped-def]
    columns = cost.shape[2]
    for y in range(cost.shape[0]):
        for k in range(cost.shape[1]):
            round_costs(cost[y, k], unit, out[y, k, :columns])


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
def _sweep(cost, image, small, large, border, spread, forward, fresh, first, end, paths, least, total):  # type: ignore[no-untyped-def]
    """The paths from the row before to the next one, added to `total`: down the columns and, for `spread` = 1, aslant.

    Backward, the rows are walked from the last to the first; `fresh` sums overwrite `total`.

    L(p, k) = C(p, k) + min(L(q, k), L(q, k +- 1) + P1, min L(q) + P2) - min L(q), in whole units.

    Parameters
    ----------
    cost
        (rows, planes, columns) of unsigned integers; rows and columns beyond the image are not read.
    border
        More than any L, and so much that `small` more is still a number of their kind.
    first, end
        Which rows are walked, counted from where the walk begins. Those before have been walked already.
    paths
        (1 + 2 spread, 2, planes + 2, columns + 2) L of the last row and the one before, of the kind of `cost`: a column
        more on both sides, from where a path begins anew.
    least
        (1 + 2 spread, 2, columns + 2) min L.
    """
    # short loops over the columns, each over few arrays: so each becomes instructions for many columns at once
    (rows, columns, _), planes = image.shape, cost.shape[1]
    count, kind = 2 * spread + 1, cost.dtype.type
    if first == 0:
        paths.fill(kind(0))
        least.fill(kind(0))
        paths[:, :, 0] = border  # before the first plane there is none, nor after the last
        paths[:, :, planes + 1] = border
    cap = np.zeros((count, columns), cost.dtype)
    for row in range(first, end):
        y, y_old = (row, row - 1) if forward else (rows - 1 - row, rows - row)
        old, new = row % 2, 1 - row % 2
        for d in range(count):
            for x in range(columns):
                x_old = x + spread - d
                begins = row == 0 or x_old < 0 or x_old >= columns
                jump = kind(0) if begins else large[contrast(image[y, x], image[y_old, x_old])]
                cap[d, x] = kind(least[d, old, x_old + 1] + jump)
            for x in range(columns):
                least[d, new, x + 1] = border
        for k in range(planes):
            for d in range(count):
                start = 1 + spread - d
                stop, before = start + columns, paths[d, old]
                path = paths[d, new, k + 1, 1 : 1 + columns]
                _extend(
                    before[k, start:stop], before[k + 2, start:stop], before[k + 1, start:stop], small, cap[d],
                    least[d, old, start:stop], cost[y, k, :columns], path,
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


def _band(rows: int, threads: int) -> int:
    """How many rows are turned at a time: about `BAND`, and as many bands for every thread."""
    bands = -(-rows // (BAND * max(1, threads))) * max(1, threads)
    return -(-rows // (bands * EACH)) * EACH


@frozen(eq=False)
class Paths:
    """How costs are counted in whole numbers and what steps of a path cost.

    Parameters
    ----------
    kind
        Of the whole numbers.
    unit
        How many of them make a cost of 1: 4095 for costs up to 1 and a P2 of 1.
    small, large
        P1, and P2 by contrast to the previous pixel (`penalties`), in these units.
    """

    kind: type[np.uint16 | np.uint32]
    unit: float
    small: Any
    large: NDArray[Any]

    @classmethod
    def of(cls, small: float, large: float, edge: float, largest: float) -> "Paths":
        """For costs up to the `largest`, and steps as in `aggregate`."""
        table = penalties(small, large, edge)
        kind, unit = _units(largest, table)
        return cls(kind, unit, kind(round(small * unit)), np.rint(table.astype(float) * unit).astype(kind))

    @staticmethod
    def wide(shape: tuple[int, ...]) -> tuple[int, int, int]:
        """(H, planes, W) with as many more rows and columns as it takes to turn them."""
        rows, planes, columns = shape
        return -(-rows // EACH) * EACH, planes, -(-columns // EACH) * EACH

    def held(self, shape: tuple[int, ...]) -> int:
        """Bytes of costs in whole numbers and their sums, on one thread, for (H, planes, W)."""
        rows, planes, columns = self.wide(shape)
        return 2 * np.dtype(self.kind).itemsize * (rows + min(rows, _band(shape[0], 1))) * planes * columns

    def whole(self, cost: NDArray[np.float32], room: Room, threads: int = 1) -> NDArray[Any]:
        """(H, planes, W) costs in whole units, 0 where they are unknown (NaN); `wide`, with anything beyond."""
        out = room.empty("whole", self.wide(cost.shape), self.kind)
        unit = np.float32(self.unit)
        over_rows(lambda top, end: _whole(cost[top:end], unit, out[top:end]), len(cost), threads)
        return out

    def sums(self, whole: NDArray[Any], image: NDArray[np.uint8], room: Room, threads: int = 1) -> NDArray[Any]:
        """(H, planes, W or up to three more) sums of the path costs; the next from the `room` overwrite them.

        Parameters
        ----------
        whole
            `wide` (H, planes, W) costs, of which those of the `image` (H, W, 3) count.
        """
        total = room.empty("total", whole.shape, self.kind)
        steps = self.small, self.large, self.kind(np.iinfo(self.kind).max >> 1)
        planes, (rows, columns, _) = whole.shape[1], image.shape

        def along(top: int, end: int) -> None:
            band, part = whole[top : -(-end // EACH) * EACH], image[top:end].transpose(1, 0, 2).copy()
            with room.lent() as own:
                turned, sums = (own.empty(name, band.shape[::-1], self.kind) for name in ("turned", "along"))
                walked = own.empty("walked", (1, 2, planes + 2, end - top + 2), self.kind)
                least = own.empty("least", (1, 2, end - top + 2), self.kind)
                turn_volume(band, turned, 1)
                for forward in (True, False):
                    _sweep(turned, part, *steps, 0, forward, forward, 0, columns, walked, least, sums)
                turn_volume(sums, total[top : top + len(band)], 1)

        over_rows(along, rows, threads, _band(rows, threads))
        walked = room.empty("walked", (2, 3, 2, planes + 2, columns + 2), self.kind)
        least = room.empty("least", (2, 3, 2, columns + 2), self.kind)
        half = (rows + 1) // 2

        def down(side: int, first: int, end: int) -> None:
            _sweep(whole, image, *steps, 1, side == 0, False, first, end, walked[side], least[side], total)

        # two threads walk towards each other; where they have met, each adds to what the other has left
        over_rows(lambda side, _: down(side, 0, (half, rows - half)[side]), 2, threads, 1)
        over_rows(lambda side, _: down(side, (half, rows - half)[side], rows), 2, threads, 1)
        return total[:rows]


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
    paths = Paths.of(small, large, edge, float(np.nanmax(cost, initial=0)) if largest is None else largest)
    room = room or Room()
    return paths.sums(paths.whole(cost, room, threads), image, room, threads), paths.unit
