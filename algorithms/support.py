"""Costs on the rays of a view, some rows at a time: averaged over pixels of one colour, charged, in whole numbers."""

from collections.abc import Callable
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, kernel, literal
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.paths import round_costs
from matbench.algorithms.room import Room
from matbench.algorithms.similarity import Matcher

AT_ONCE = 8  # rows: what is found of them stays in the cache until it is used
SHARES = 4  # parts that each thread takes of the rows: their first and last rows are found by two


@helper
def _shares(image, y, radius, fall, share):  # type: ignore[no-untyped-def]
    """share (window rows, window columns, W) = fall[largest difference over the colours] of the pixels around each.

    They sum to 1; beyond the image they are 0.
    """
    height, width, _ = image.shape
    total = np.zeros(width, np.float32)
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            row = share[dy + radius, dx + radius]
            fill(np.float32(0), row)
            if not 0 <= y + dy < height:
                continue
            for x in range(max(0, -dx), min(width, width - dx)):
                gap = np.int64(0)
                for c in range(3):
                    gap = max(gap, abs(np.int64(image[y + dy, x + dx, c]) - np.int64(image[y, x, c])))
                row[x] = fall[gap]
                total[x] += row[x]
    for dy in range(share.shape[0]):
        for dx in range(share.shape[1]):
            row = share[dy, dx]
            for x in range(width):
                row[x] /= total[x]


@helper
def _add_share(part, share, total):  # type: ignore[no-untyped-def]
    """total += share * part."""
    for x in range(total.size):
        total[x] += share[x] * part[x]


@helper
def _mean_around(cost, y, k, share, left_out, total):  # type: ignore[no-untyped-def]
    """total = weighted mean of the costs around the pixels of row y; `left_out` rows of a window lack at either end."""
    width, radius = total.size, share.shape[0] // 2
    fill(np.float32(0), total)
    for dy in range(-radius + left_out[0], radius + 1 - left_out[1]):
        part = cost[y + dy, k]
        for dx in range(-radius, radius + 1):
            left, right = max(0, -dx), max(0, min(width, width - dx))
            if left < right:
                weight = share[dy + radius, dx + radius]
                _add_share(part[left + dx : right + dx], weight[left:right], total[left:right])


@kernel
def support(cost, image, first, skipped, fall, radius, out):  # type: ignore[no-untyped-def]
    """out = weighted mean of the costs around a pixel, as far as its neighbours are of its colour.

    Parameters
    ----------
    cost
        (rows, planes, width): `skipped` rows of the image before those of `out`, and as many after
        as its window or the image has.
    first
        Row of the image that is the first of `out`.
    image
        (H, W, 3) uint8 reference view.
    fall
        (256,) weight by the largest difference over the colours.
    out
        (rows, planes, width), overwritten.
    """
    height, width, _ = image.shape
    share = np.empty((2 * radius + 1, 2 * radius + 1, width), np.float32)
    for row in range(out.shape[0]):
        _shares(image, first + row, radius, fall, share)
        left_out = max(0, radius - first - row), max(0, first + row + radius + 1 - height)
        for k in range(out.shape[1]):
            _mean_around(cost, row + skipped, k, share, left_out, out[row, k])


@literal
def _charge(material, weight, cost):  # type: ignore[no-untyped-def]
    one = np.float32(1)
    for x in range(cost.size):
        cost[x] += weight * (one - material[x])


@kernel
def support_whole(cost, image, first, skipped, fall, radius, material, weight, unit, out):  # type: ignore[no-untyped-def]
    """out = (the mean that is `support`'s + weight (1 - material)) in whole units.

    Parameters
    ----------
    cost, image, first, skipped, fall, radius
        As in `support`.
    material
        As `cost`, or without rows: nothing is charged then.
    unit
        How many units are a cost of 1.
    out
        (rows, planes, width or more) whole numbers, overwritten as far as the width.
    """
    height, width, _ = image.shape
    share = np.empty((2 * radius + 1, 2 * radius + 1, width), np.float32)
    total = np.empty(width, np.float32)
    for y in range(out.shape[0]):
        _shares(image, first + y, radius, fall, share)
        left_out = max(0, radius - first - y), max(0, first + y + radius + 1 - height)
        for k in range(out.shape[1]):
            _mean_around(cost, y + skipped, k, share, left_out, total)
            if material.shape[0] > 0:
                _charge(material[y + skipped, k], weight, total)
            round_costs(total, unit, out[y, k, :width])


Combine = Callable[[int, NDArray[np.float32], NDArray[np.float32], Room], None]
"""``combine(first row, cost, mu, room)`` overwrites (rows, planes, width) costs and, if it finds any, materialities."""


@frozen(eq=False)
class Costs:
    """Costs of the points on the rays of the reference view, found some rows at a time.

    Similarities are not kept, nor what is averaged: of all rows they would take too much memory.

    Parameters
    ----------
    combine
        Finds the costs of some rows; where the rays of all views end somewhere, materialities, too.
    radius
        Costs are averaged over windows that reach so many pixels from the middle, ...
    fall
        ... with (256,) weights by the largest difference to the middle pixel over the colours.
    charged
        What a point costs more for each (1 - mu).
    solid
        Are materialities found?
    """

    matcher: Matcher
    combine: Combine
    radius: int
    fall: NDArray[np.float32]
    charged: float = 0.0
    solid: bool = False

    def whole(self, unit: float, out: NDArray[Any], room: Room, threads: int = 1) -> None:
        """Overwrites `out` (H or more, planes, W or more) with the costs in whole units."""
        image, weights = self.matcher.scene.views[self.matcher.scene.ref], (np.float32(self.charged), np.float32(unit))

        def finish(begin: int, end: int, skipped: int, cost: NDArray[np.float32], mu: NDArray[np.float32]) -> None:
            part, own = out[begin:end], mu if self.charged else mu[:0]
            support_whole(cost, image, begin, skipped, self.fall, self.radius, own, *weights, part)

        self._each(finish, room, threads)

    def real(self, threads: int = 1) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(H, planes, W) costs without what is charged, and materialities, which have no rows if none are found."""
        space, image = self.matcher.space, self.matcher.scene.views[self.matcher.scene.ref]
        found = np.empty((space.rows, space.planes, space.width), np.float32)
        solid = np.empty((space.rows if self.solid else 0, space.planes, space.width), np.float32)

        def finish(begin: int, end: int, skipped: int, cost: NDArray[np.float32], mu: NDArray[np.float32]) -> None:
            support(cost, image, begin, skipped, self.fall, self.radius, found[begin:end])
            if self.solid:
                solid[begin:end] = mu[skipped : skipped + end - begin]

        self._each(finish, Room(), threads)
        return found, solid

    def _each(
        self,
        finish: Callable[[int, int, int, NDArray[np.float32], NDArray[np.float32]], None],
        room: Room,
        threads: int,
    ) -> None:
        """``finish(first, end, skipped, cost, mu)`` for all rows: what it is given begins `skipped` rows before."""
        space, reach = self.matcher.space, self.radius

        def find(first: int, end: int) -> None:
            shape = min(AT_ONCE, end - first) + 2 * reach, space.planes, space.width
            with room.lent() as own:
                cost = own.empty("cost", shape, np.float32)
                mu = own.empty("mu", shape if self.solid else (0, *shape[1:]), np.float32)
                top = ready = max(0, first - reach)  # rows top..ready are there
                for begin in range(first, end, AT_ONCE):
                    stop = min(end, begin + AT_ONCE)
                    needed, after = max(0, begin - reach), min(space.rows, stop + reach)
                    for kept in (cost, mu):
                        kept[: ready - needed] = kept[needed - top : ready - top]
                    top = needed
                    place = slice(ready - top, after - top)
                    self.combine(ready, cost[place], mu[place], own)
                    ready = after
                    finish(begin, stop, begin - top, cost[: ready - top], mu[: ready - top])

        over_rows(find, space.rows, threads, space.rows if threads <= 1 else -(-space.rows // (SHARES * threads)))
