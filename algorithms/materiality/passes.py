"""Passes over all rows: the energy (equation 5) of a whole scene, its gradient, and steps along it."""

from collections.abc import Callable

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, kernel
from matbench.algorithms.materiality.energy import chain, descend, mark_layers, match, see_layer, shade, tie
from matbench.algorithms.parallel import over_rows, share
from matbench.algorithms.similarity import FULL
from matbench.space import DisparitySpace

LINKS = 4  # pairs that one loop takes on: with more, the compiler gives up checking that its arrays do not overlap
LAYER = 1 << 18  # numbers of visibilities kept at a time: they stay in the second-level cache

GROUP = (0,) * LINKS  # in a type that the compiler counts

Floats = NDArray[np.floating]


@helper
def _extrapolate(now, before, beta, one, out):  # type: ignore[no-untyped-def]
    """out = now + beta (now - before), kept within [0, 1], and its sum."""
    zero = one - one
    total = 0.0
    if beta == zero:  # whatever `before` is
        for x in range(now.size):
            out[x] = now[x]
            total += np.float64(now[x])
    else:
        for x in range(now.size):
            value = min(max(now[x] + beta * (now[x] - before[x]), zero), one)
            out[x] = value
            total += np.float64(value)
    return total


@helper
def _extrapolate_row(now, before, beta, one, out):  # type: ignore[no-untyped-def]
    """The same for the planes of a row; columns that `out` has more, half at either end, are left alone."""
    total = 0.0
    planes, columns = now.shape
    more = (out.shape[1] - columns) // 2
    for k in range(planes):
        total += _extrapolate(now[k], before[k], beta, one, out[k, more : more + columns])
    return total


@kernel
def _count_rows(now, before, beta, one, top, end, counts):  # type: ignore[no-untyped-def]
    """Sums of the rows top..end of the extrapolated materialities."""
    mu = np.empty(now.shape[1:], now.dtype)
    for y in range(top, end):
        counts[y] = _extrapolate_row(now[y], before[y], beta, one, mu)


@kernel
def _border_rows(now, before, beta, one, block, beyond):  # type: ignore[no-untyped-def]
    """The extrapolated rows just before and just after every `block` rows: (blocks, 2, planes, columns)."""
    for place in range(beyond.shape[0]):
        for side, y in enumerate((place * block - 1, (place + 1) * block)):
            if 0 <= y < now.shape[0]:
                _extrapolate_row(now[y], before[y], beta, one, beyond[place, side])


@helper
def _match_pairs(mu, seen, rho, k, pairs, slide, origin, samples, full, pulls):  # type: ignore[no-untyped-def]
    """Pairs of any views in one plane, one after another: sum of r^2; `pulls` (views, wide) gain r V."""
    margin = mu.size - samples
    energy = 0.0
    for p in range(pairs.shape[0]):
        i, j = pairs[p, 0], pairs[p, 1]
        place_i, place_j = margin + origin - i * slide, margin + origin - j * slide
        low, high = margin - min(place_i, place_j), margin - max(place_i, place_j) + samples
        if low < high:
            energy += match(
                mu[low:high],
                seen[i, place_i + low : place_i + high],
                seen[j, place_j + low : place_j + high],
                rho[p, k, low:high],
                full,
                pulls[i, place_i + low : place_i + high],
                pulls[j, place_j + low : place_j + high],
            )
    return energy


def _room(space: DisparitySpace, kind: np.dtype[np.floating]) -> tuple[Floats, ...]:
    """Workspace of `pass_rows`, which any thread needs once.

    Returns
    -------
    ring
        (3, planes, columns + 2) the point in the rows y - 1, y and y + 1, a column more at either end.
    marks
        (layers, views, samples) V of the nearest plane of every layer of planes.
    seen
        (depth, views, wide) V of one layer.
    behind, pulls
        (views, wide) A and the sums of r V of all pairs.
    line
        (2, columns) slopes and pulls of a plane.
    """
    wide = 2 * space.columns - space.samples
    depth = max(1, min(space.planes, LAYER // (space.views * wide)))
    shapes = (
        (3, space.planes, space.columns + 2),
        (-(-space.planes // depth), space.views, space.samples),
        (depth, space.views, wide),
        (space.views, wide),
        (space.views, wide),
        (2, space.columns),
    )
    return tuple(np.zeros(shape, kind) for shape in shapes)


@kernel
def pass_rows(  # type: ignore[no-untyped-def]
    now, before, beta, one, rho, full, views, pairs, links, rest, samples, first, origin, weights, across, along,
    pressure, target, bias, beyond, step, top, end, room, new, slopes, sums,
):  # fmt: skip
    """One pass over rows top..end: energies and gradient at the extrapolated point, and the step.

    Parameters
    ----------
    now, before
        (rows, planes, columns) materialities of this pass and the one before; the point is
        now + beta (now - before).
    rho
        (rows, pairs, planes, columns) similarities in units of 1 / full; 0 outside either frustum.
    pairs, links, rest
        One of them, the others None: (pairs, 2) views of each pair; or, where pairs are
        consecutive, a tuple as long as there are pairs, which are taken in one loop; or one as long
        as the pairs that are left when loops have taken LINKS at a time.
    weights
        Edge weights down and right as from `edge_weights`, or None: no ties.
    across, along
        lambda_y and lambda_x for one unit of weight.
    pressure, target, bias
        The count term's derivative in a row is pressure (sum - target) + bias.
    beyond
        (2, planes, columns) the point in the rows top - 1 and end; not read without ties.
    room
        Workspace from `_room`.
    new
        (rows, planes, columns), overwritten: the stepped materialities; may be `before`.
    slopes
        The same shape, overwritten with dE/dmu, or None.
    sums
        (rows, 3), overwritten: E_data, adjacent-plane E_smooth and sum of mu of each row.
    """
    rows, planes, columns = now.shape
    kind, zero = now.dtype.type, one - one
    margin = columns - samples
    ring, marks, seen, behind, pulls, line = room
    depth, slope, pull = seen.shape[0], line[0], line[1]
    for y in range(top, end):
        for row in range(y - 1 if y == top else y + 1, y + 2):
            if top <= row < end:
                sums[row, 2] = _extrapolate_row(now[row], before[row], beta, one, ring[row % 3])
            elif weights is not None and 0 <= row < rows:
                _extrapolate_row(beyond[int(row > y)], beyond[0], zero, one, ring[row % 3])
        above, here, below = ring[max(0, y - 1) % 3], ring[y % 3], ring[min(rows - 1, y + 1) % 3]
        offset = kind(pressure * (sums[y, 2] - target) + bias)
        data, ties = 0.0, 0.0
        for i in range(views):
            fill(zero, behind[i])
        mark_layers(here, first, origin - 1, one, depth, marks)
        for bottom in range(0, planes, depth):
            nearest = min(planes, bottom + depth)
            see_layer(here, marks[bottom // depth], bottom, nearest, first, origin - 1, one, margin, seen)
            for k in range(bottom, nearest):
                slide = first + k
                mu, through, place = here[k, 1 : 1 + columns], seen[k - bottom], margin + origin
                if weights is not None:
                    w_across, w_along = weights
                    ties += tie(
                        here[k], above[k], below[k], w_across[max(0, y - 1), k], w_across[y, k], w_along[y, k],
                        across, along, slope,
                    )  # fmt: skip
                elif links is None:
                    fill(zero, slope)
                if links is not None:
                    data += chain(
                        mu, through, rho, y, k, 0, links, place, slide, full, one, behind, None, None, step, offset,
                        new, slopes,
                    )  # fmt: skip
                if rest is not None:
                    fill(zero, pull)
                    for view in range(0, views - 1 - len(rest), LINKS):
                        data += chain(
                            mu, through, rho, y, k, view, GROUP, place - view * slide, slide, full, one, behind,
                            slope, pull, step, offset, None, None,
                        )  # fmt: skip
                    view = views - 1 - len(rest)
                    data += chain(
                        mu, through, rho, y, k, view, rest, place - view * slide, slide, full, one, behind,
                        slope, pull, step, offset, new, slopes,
                    )  # fmt: skip
                if pairs is not None:
                    data += _match_pairs(mu, through, rho[y], k, pairs, slide, origin, samples, full, pulls)
                    for i in range(views):
                        start = i * slide - origin
                        shade(
                            mu[start : start + samples],
                            through[i, margin : margin + samples],
                            one / (one + one),
                            slope[start : start + samples],
                            pulls[i, margin : margin + samples],
                            behind[i, margin : margin + samples],
                        )
                    descend(mu, slope, y, k, step, offset, one, new, slopes)
        sums[y, 0], sums[y, 1] = data, ties


@frozen(eq=False)
class Energy:
    """Equation 5 for one scene: E = E_data + E_smooth, with E_smooth = count term + adjacent points.

    Parameters
    ----------
    space
        Its target points.
    pairs
        (pairs, 2) views compared.
    rho
        (rows, pairs, planes, columns) similarities in units of `scale`.
    target
        N, the materialities that one epipolar plane should hold.
    count
        lambda of the count term lambda / N (sum mu - N)^2 (equation 7, over N so that lambda does
        not depend on the image's size).
    per_row
        One count term for every epipolar plane; otherwise one for all, with `rows` N.
    across, along
        lambda_y and lambda_x of the squared differences to the next row and the next column.
    weights
        Their edge weights from `edge_weights`; not read where both are 0.
    scale
        Value of one unit of `rho`.
    """

    space: DisparitySpace
    pairs: NDArray[np.int64]
    rho: NDArray[np.uint8] | Floats
    target: float
    count: float
    per_row: bool
    across: float
    along: float
    weights: tuple[NDArray[np.uint8], NDArray[np.uint8]]
    scale: float = 1 / FULL
    rooms: list[tuple[Floats, ...]] = field(init=False, factory=list)

    @property
    def safe_step(self) -> float:
        """Below the inverse of the largest curvature of the terms that couple many points (equation 11)."""
        _, planes, columns = self.space.shape
        counting = 2 * self.count * planes * columns / self.target
        return 1 / (counting + 8 * (self.across + self.along) + 2 * len(self.pairs))

    @property
    def tied(self) -> bool:
        """Whether adjacent points are."""
        return self.across > 0 or self.along > 0

    @property
    def uncoupled(self) -> bool:
        """Whether no term has points of several rows."""
        return self.per_row and not self.across

    @property
    def pressure(self) -> float:
        """The count term's derivative is this times what there is in excess of N."""
        return 2 * self.count / self.target

    def terms(self, kind: type[np.floating]) -> tuple[object, ...]:
        """`rho` to `along` of `pass_rows`."""
        space, full = self.space, 1 / self.scale
        ties = self.weights if self.tied else None, kind(self.across * full / FULL), kind(self.along * full / FULL)
        return self.rho, kind(full), space.views, *self._taken(), space.samples, space.first, space.origin, *ties

    def over_rows(
        self, work: Callable[[int, int, tuple[Floats, ...]], None], kind: type[np.floating], threads: int
    ) -> None:
        """Call ``work(top, end, room)`` for blocks of rows; a workspace outlives its pass."""

        def borrow(top: int, end: int) -> None:
            room = self.rooms.pop() if self.rooms else _room(self.space, np.dtype(kind))
            work(top, end, room)
            self.rooms.append(room)

        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))

    def _taken(self) -> tuple[NDArray[np.int64] | None, tuple[int, ...] | None, tuple[int, ...] | None]:
        """`pairs`, `links` and `rest` of `pass_rows`."""
        steps = np.arange(self.space.views - 1)
        if not np.array_equal(self.pairs, np.stack([steps, steps + 1], axis=1)):
            return self.pairs, None, None
        if len(steps) <= LINKS and not self.tied:
            return None, (0,) * len(steps), None
        return None, None, (0,) * ((len(steps) - 1) % LINKS + 1)

    def step(
        self, now: Floats, before: Floats, beta: float, step: float, new: Floats, slopes: Floats | None, threads: int
    ) -> dict[str, float]:
        """Energies at now + beta (now - before); the point after a gradient step from there goes to `new`.

        `new` may be `before`. `slopes`, (rows, planes, columns), is filled with dE/dmu if given.
        All arrays have one type.
        """
        space, kind = self.space, now.dtype.type
        extrapolated = now, before, kind(beta), kind(1)
        full, block = 1 / self.scale, share(space.rows, threads)
        sums = np.empty((space.rows, 3))
        bias = 0.0
        if not self.per_row:
            over_rows(lambda top, end: _count_rows(*extrapolated, top, end, sums[:, 2]), space.rows, threads, block)
            bias = self.pressure * (float(sums[:, 2].sum()) / space.rows - self.target)
        # rows are overwritten in place: what their neighbours in other blocks read is set aside
        beyond = np.empty((-(-space.rows // block) if self.tied else 0, 2, *now.shape[1:]), now.dtype)
        _border_rows(*extrapolated, block, beyond)
        terms = self.terms(kind)

        def work(top: int, end: int, room: tuple[Floats, ...]) -> None:
            pass_rows(
                *extrapolated,
                *terms,
                self.pressure * full / 2 if self.per_row else 0.0,
                self.target,
                bias * full / 2,
                beyond[top // block] if self.tied else now[:2],
                kind(2 * step / full),
                top,
                end,
                room,
                new,
                slopes,
                sums,
            )

        self.over_rows(work, kind, threads)
        if slopes is not None:
            slopes *= kind(2 / full)
        data, adjacent, total = (float(part) for part in sums.sum(axis=0) / (full * full, full, 1))
        excess = (sums[:, 2] - self.target) if self.per_row else np.array([total / space.rows - self.target])
        counted = self.count / self.target * float(np.square(excess).sum())
        if not self.per_row:
            counted *= space.rows
        return {
            "total": data + counted + adjacent,
            "data": data,
            "smooth": counted + adjacent,
            "count": counted,
            "adjacent": adjacent,
        }
