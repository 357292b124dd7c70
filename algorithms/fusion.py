"""One cost for every pixel and plane of a view, from the similarities of several pairs (equations 13-15)."""

from collections.abc import Callable

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, kernel
from matbench.algorithms.parallel import over_rows, share
from matbench.algorithms.pixels import weigh_pixels
from matbench.algorithms.room import Room
from matbench.algorithms.similarity import FULL, Matcher
from matbench.algorithms.windows import Features

# What is assumed of a point before any view or pair is asked. It weighs as half of one; a tenth of its rays end there.
# Without it, one view alone would be as certain as all that agree, and a point that none sees would be 0 / 0.
PRIOR, ENDED = 0.5, 0.05
BLOCK = 128  # columns
AT_ONCE = 16  # rows: their similarities stay in the cache until they are combined


@helper
def _exchange(high, low):  # type: ignore[no-untyped-def]
    """Puts the larger of two numbers first, column by column."""
    for x in range(high.size):
        a, b = high[x], low[x]
        high[x], low[x] = max(a, b), min(a, b)


@helper
def _copy(values, row):  # type: ignore[no-untyped-def]
    for x in range(row.size):
        row[x] = values[x]


@helper
def _sum_first(part, place, taken, total):  # type: ignore[no-untyped-def]
    """Adds the number of rank `place`, counted from 0, in the columns that take more than `place` numbers."""
    kind = np.uint16
    for x in range(total.size):
        value = kind(part[x])  # read in any case: else one column would be summed at a time
        total[x] = kind(total[x] + (value if taken[x] > place else kind(0)))


@helper
def _from_sums(total, share, most, cost):  # type: ignore[no-untyped-def]
    """cost = most - share total."""
    for x in range(cost.size):
        cost[x] = most[x] - share[x] * np.float32(total[x])


@helper
def _count_pairs(low, high, hidden, taken, share, most):  # type: ignore[no-untyped-def]
    """How many similarities of a point count, the share of each in the cost, and the cost if all are 0."""
    fill(np.uint16(0), taken)
    for p in range(low.size):
        for x in range(low[p], high[p]):
            taken[x] += np.uint16(1)
    for x in range(taken.size):
        half = (taken[x] + 1) // 2
        taken[x] = half
        share[x] = np.float32(1 / FULL) / np.float32(max(half, 1))
        most[x] = np.float32(1) if half > 0 else hidden


@kernel
def better_half(rho, low, high, hidden, cost):  # type: ignore[no-untyped-def]
    """1 - the mean of the better half (rounded up) of a point's similarities, over pairs with the point in both frusta.

    Where there is no such pair, the cost is `hidden`. The better half is enough: if half of the views cannot see a
    point, the other half still can.

    Parameters
    ----------
    rho
        (rows, pairs, planes, columns) uint8 in 255ths.
    low, high
        (pairs, planes) the first column that both views of a pair see, and the one after the last.
    cost
        (rows, planes, columns) float32 in [0, 1], overwritten.
    """
    count, columns = rho.shape[1], rho.shape[3]
    wide = (columns + BLOCK - 1) // BLOCK * BLOCK  # no columns are left over from loops that take several at a time
    best = np.zeros((count, wide), np.uint8)
    taken, total = np.zeros(wide, np.uint16), np.empty(wide, np.uint16)
    share, most = np.empty(columns, np.float32), np.empty(columns, np.float32)
    for k in range(rho.shape[2]):
        _count_pairs(low[:, k], high[:, k], hidden, taken[:columns], share, most)
        for y in range(rho.shape[0]):
            for p in range(count):
                _copy(rho[y, p, k], best[p, :columns])  # 0 beyond a frustum, and so sorted behind what counts
            fill(np.uint16(0), total)
            for place in range((count + 1) // 2):  # sorts no further than the sum needs
                for p in range(count - 1, place, -1):
                    _exchange(best[p - 1], best[p])
                _sum_first(best[place], np.uint16(place), taken, total)
            _from_sums(total[:columns], share, most, cost[y, k])


@helper
def sight(found, k, through, ended, reached):  # type: ignore[no-untyped-def]
    """through = V, reached += V and ended += w at plane k, for rays that end in the planes d = `found`.

    V = k + 2 - d and w = 1 - |k - d|, both kept within 0 and 1.
    """
    zero, one, two, plane = np.float32(0), np.float32(1), np.float32(2), np.float32(k)
    for x in range(found.size):
        behind = plane - found[x]
        through[x] = min(max(behind + two, zero), one)
        ended[x] += max(one - abs(behind), zero)
        reached[x] += through[x]


@helper
def _add_seen(rho, first, second, total, weight):  # type: ignore[no-untyped-def]
    one, scale = np.float32(1), np.float32(1 / FULL)
    for x in range(rho.size):
        both = first[x] * second[x]
        total[x] += both * (one - scale * np.float32(rho[x]))
        weight[x] += both


@kernel
def weigh_seen(rho, pairs, maps, view, spans, y0, fineness, hidden, cost, material):  # type: ignore[no-untyped-def]
    """The mean dissimilarity of the pairs that see a point, and its materiality (see `seen_cost`).

    Parameters
    ----------
    rho
        (rows, pairs, planes, width) uint8 in 255ths; 0 where a frustum is left.
    maps
        (views, H, W) plane in which the ray of every pixel ends, fractions included.
    spans
        (views, planes, 6) what `Matcher.ray_spans` says of the reference view and every other.
    view
        Index of the reference view.
    y0
        Row of the views that is the first of `rho`.
    cost, material
        (rows, planes, width) float32, overwritten.
    """
    views, _, width = maps.shape
    through = np.empty((views, width), np.float32)
    ended, reached, weight = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    zero, one, prior = np.float32(0), np.float32(1), np.float32(PRIOR)
    for y in range(rho.shape[0]):
        for k in range(rho.shape[2]):
            fill(np.float32(ENDED), ended)
            fill(prior, reached)
            fill(prior, weight)
            for j in range(views):
                fill(one if j == view else zero, through[j])
                low, count = spans[j, k, 0], spans[j, k, 1]
                if j != view and count > 0:
                    # a map has one value a pixel: between two pixels the nearer one is asked
                    start = spans[j, k, 5] + (1 if 2 * spans[j, k, 4] > fineness else 0)
                    sight(
                        maps[j, y0 + y, start : start + count],
                        k,
                        through[j, low : low + count],
                        ended[low : low + count],
                        reached[low : low + count],
                    )
            total = cost[y, k]
            fill(prior * hidden, total)
            for p in range(pairs.shape[0]):
                _add_seen(rho[y, p, k], through[pairs[p, 0]], through[pairs[p, 1]], total, weight)
            for x in range(width):
                total[x] /= weight[x]
                material[y, k, x] = ended[x] / reached[x]


@kernel
def charge(material, weight, cost):  # type: ignore[no-untyped-def]
    """cost += weight (1 - material), in (rows, planes, columns)."""
    one = np.float32(1)
    for y in range(cost.shape[0]):
        for k in range(cost.shape[1]):
            paid, here = cost[y, k], material[y, k]
            for x in range(paid.size):
                paid[x] += weight * (one - here[x])


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
        for k in range(out.shape[1]):
            total = out[row, k]
            fill(np.float32(0), total)
            for dy in range(-radius, radius + 1):
                if not 0 <= first + row + dy < height:
                    continue
                part = cost[row + skipped + dy, k]
                for dx in range(-radius, radius + 1):
                    left, right = max(0, -dx), max(0, min(width, width - dx))
                    if left < right:
                        weight = share[dy + radius, dx + radius]
                        _add_share(part[left + dx : right + dx], weight[left:right], total[left:right])


@frozen
class Fusion:
    """The fusion of the similarities of several pairs into one cost on the rays of the reference view.

    Parameters
    ----------
    adaptive
        Grey levels. A pixel's cost is a weighted mean over the window, with weights exp(-|dI| / adaptive);
        |dI| is the largest difference to the middle pixel over the colours of the view. With 0 all pixels
        of a window have the same weight.
    hidden
        The cost of a point that no other view sees.
    """

    adaptive: float = field(default=10.0, validator=validators.ge(0))
    hidden: float = field(default=0.72, validator=validators.ge(0))

    def first_cost(
        self, matcher: Matcher, threads: int = 1, phases: Features | None = None, room: Room | None = None
    ) -> NDArray[np.float32]:
        """(H, planes, W) 1 - mean of the better half of rho on the reference view's pixel rays.

        It is taken from the `room`, if there is one: the next from there overwrites it.
        """
        spans = np.stack([matcher.ray_spans(i, j) for i, j in matcher.pairs])
        low, high = spans[..., 0].copy(), spans[..., 0] + spans[..., 1]

        features = matcher.phases(threads) if phases is None else phases

        def combine(top: int, cost: NDArray[np.float32]) -> None:
            rho = matcher.rays(features, top, top + len(cost), self._side)
            better_half(rho, low, high, np.float32(self.hidden), cost)

        return self._cost(matcher, threads, combine, room or Room())

    def seen_cost(
        self,
        matcher: Matcher,
        maps: NDArray[np.float32],
        threads: int = 1,
        phases: Features | None = None,
        room: Room | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Cost on the reference view's rays from the views that see each point, and the point's materiality.

        Let d_j be the plane in which the ray of view j ends. Then w_j(k) = max(0, 1 - |k - d_j|) says where
        the ray ends, and V_j(k) = 1 - sum of w_j(k') over k' > k + 1 says which points it reaches. A plane
        does not hide the plane just behind it, because surfaces may lie between the two. With sums over
        the pairs ij, and over the views j other than the reference view,

        - cost = (sum V_i V_j (1 - rho_ij) + 0.5 hidden) / (sum V_i V_j + 0.5),
        - mu = (sum w_j + 0.05) / (sum V_j + 0.5).

        Parameters
        ----------
        maps
            (views, H, W) planes of the space, fractions included, no NaN.

        Returns
        -------
        Two (H, planes, W) float32 arrays: the cost and mu. They are taken from the `room`, as those of `first_cost`.
        """
        space, view = matcher.space, matcher.scene.ref
        spans = np.stack([matcher.ray_spans(view, j) for j in range(space.views)])
        room = room or Room()
        material = room.empty("material", (space.rows, space.planes, space.width), np.float32)

        features = matcher.phases(threads) if phases is None else phases
        side, hidden = self._side, np.float32(self.hidden)

        def pixels(top: int, cost: NDArray[np.float32]) -> None:
            criterion, part = matcher.pixel_criterion(features), material[top : top + len(cost)]
            prior, ended = np.float32(PRIOR), np.float32(ENDED)
            weigh_pixels(features, maps, view, *criterion, spans, space.fineness, top, prior, ended, hidden, cost, part)

        def windows(top: int, cost: NDArray[np.float32]) -> None:
            rho, part = matcher.rays(features, top, top + len(cost), side), material[top : top + len(cost)]
            weigh_seen(rho, matcher.pairs, maps, view, spans, top, space.fineness, hidden, cost, part)

        alone = matcher.by_pixels(side) and matcher.settings.pairs == "reference"
        return self._cost(matcher, threads, pixels if alone else windows, room), material

    @property
    def _side(self) -> int | None:
        """Of the windows that are compared, if it is not that of the settings."""
        return 1 if self.adaptive else None

    def _cost(
        self, matcher: Matcher, threads: int, combine: Callable[[int, NDArray[np.float32]], None], room: Room
    ) -> NDArray[np.float32]:
        """Find costs some rows at a time, by ``combine(first row, cost)``, and average them.

        Similarities are not kept: of all rows they would take too much memory.
        """
        space, image = matcher.space, matcher.scene.views[matcher.scene.ref]
        radius = matcher.settings.window // 2 if self.adaptive else 0
        fall = np.exp(np.arange(256) / -(self.adaptive or np.inf)).astype(np.float32)
        cost: NDArray[np.float32] = room.empty("cost", (space.rows, space.planes, space.width), np.float32)

        def fill_rows(first: int, end: int) -> None:
            top, bottom = max(0, first - radius), min(space.rows, end + radius)
            part = np.empty((bottom - top, *cost.shape[1:]), np.float32) if radius else cost[first:end]
            ready = top
            for begin in range(first, end, AT_ONCE):
                stop = min(end, begin + AT_ONCE)
                before, after = max(0, begin - radius), min(space.rows, stop + radius)
                combine(ready, part[ready - top : after - top])
                ready = after
                if radius:
                    around = part[before - top : after - top]
                    support(around, image, begin, begin - before, fall, radius, cost[begin:stop])

        over_rows(fill_rows, space.rows, threads, min(share(space.rows, threads), 4 * AT_ONCE))
        return cost
