"""One cost for every pixel and plane of a view, from the similarities of several pairs (equations 13-15)."""

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.agreement import ENDED, PRIOR, agree_rows
from matbench.algorithms.kernels import fill, helper, kernel
from matbench.algorithms.pixels import weigh_pixels
from matbench.algorithms.room import Room
from matbench.algorithms.similarity import FULL, Matcher
from matbench.algorithms.support import AT_ONCE, Combine, Costs
from matbench.algorithms.support import support as support
from matbench.algorithms.windows import Features

BLOCK = 128  # columns


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

    def largest(self, charged: float = 0.0) -> float:
        """No cost is more than this, with up to `charged` more for what is not material."""
        return max(1.0, self.hidden) + charged

    def held(self, matcher: Matcher, charged: float = 0.0) -> int:
        """Bytes of similarities, costs and, if charged, materialities of the rows that one thread works on."""
        space = matcher.space
        rows = min(AT_ONCE, space.rows) + 2 * self._reach(matcher)
        return int(rows) * space.planes * space.width * (len(matcher.pairs) + 4 * (1 + (charged != 0)))

    def first_cost(self, matcher: Matcher, threads: int = 1, phases: Features | None = None) -> NDArray[np.float32]:
        """(H, planes, W) 1 - mean of the better half of rho on the reference view's pixel rays."""
        return self.first(matcher, matcher.phases(threads) if phases is None else phases).real(threads)[0]

    def seen_cost(
        self, matcher: Matcher, maps: NDArray[np.float32], threads: int = 1, phases: Features | None = None
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
        Two (H, planes, W) float32 arrays: the cost and mu.
        """
        phases = matcher.phases(threads) if phases is None else phases
        return self.seen(matcher, phases, maps, 0.0).real(threads)

    def first(self, matcher: Matcher, phases: Features) -> Costs:
        """What `first_cost` gives."""
        spans = np.stack([matcher.ray_spans(i, j) for i, j in matcher.pairs])
        low, high = spans[..., 0].copy(), spans[..., 0] + spans[..., 1]

        def combine(top: int, cost: NDArray[np.float32], _: NDArray[np.float32], room: Room) -> None:
            rho = matcher.rays(phases, top, top + len(cost), self._side, room)
            better_half(rho, low, high, np.float32(self.hidden), cost)

        return self._averaged(matcher, combine)

    def seen(
        self,
        matcher: Matcher,
        phases: Features,
        maps: NDArray[np.float32],
        charged: float,
        visibility: bool = True,
    ) -> Costs:
        """cost + charged (1 - mu) as `seen_cost` gives them; without `visibility`, of `first_cost` and `agreement`."""
        space, view, hidden = matcher.space, matcher.scene.ref, np.float32(self.hidden)
        spans = np.stack([matcher.ray_spans(view, j) for j in range(space.views)])

        def pixels(top: int, cost: NDArray[np.float32], mu: NDArray[np.float32], _: Room) -> None:
            criterion = matcher.pixel_criterion(phases)
            prior, ended = np.float32(PRIOR), np.float32(ENDED)
            weigh_pixels(phases, maps, view, *criterion, spans, space.fineness, top, prior, ended, hidden, cost, mu)

        def windows(top: int, cost: NDArray[np.float32], mu: NDArray[np.float32], room: Room) -> None:
            rho = matcher.rays(phases, top, top + len(cost), self._side, room)
            weigh_seen(rho, matcher.pairs, maps, view, spans, top, space.fineness, hidden, cost, mu)

        if visibility:
            alone = matcher.by_pixels(self._side) and matcher.settings.pairs == "reference"
            return self._averaged(matcher, pixels if alone else windows, charged, solid=True)
        first = self.first(matcher, phases)

        def agreeing(top: int, cost: NDArray[np.float32], mu: NDArray[np.float32], room: Room) -> None:
            first.combine(top, cost, mu, room)
            agree_rows(maps, view, spans, space.fineness, top, mu)

        return self._averaged(matcher, agreeing, charged, solid=True)

    @property
    def _side(self) -> int | None:
        """Of the windows that are compared, if it is not that of the settings."""
        return 1 if self.adaptive else None

    def _averaged(self, matcher: Matcher, combine: Combine, charged: float = 0.0, solid: bool = False) -> Costs:
        fall = np.exp(np.arange(256) / -(self.adaptive or np.inf)).astype(np.float32)
        return Costs(matcher, combine, self._reach(matcher), fall, charged, solid)

    def _reach(self, matcher: Matcher) -> int:
        return matcher.settings.window // 2 if self.adaptive else 0
