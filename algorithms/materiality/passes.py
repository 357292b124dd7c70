"""Passes over all rows: energies and gradient (equations 5 to 10) at a point, and a step from there."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, inlined, kernel
from matbench.algorithms.materiality.energy import Rays, chain, descend, mark_layers, match, see_layer, shade, tie
from matbench.space import DisparitySpace

LINKS = 4  # pairs that one loop takes on: with more, the compiler gives up checking that its arrays do not overlap
LAYER = 1 << 18  # numbers of visibilities kept at a time: they stay in the second-level cache

GROUP = (0,) * LINKS  # in a type that the compiler counts

Floats = NDArray[np.floating]


class Point(NamedTuple):
    """Where a pass takes energies and gradient: now + beta (now - before), kept within [0, 1].

    Parameters
    ----------
    now, before
        (rows, planes, columns) materialities of this pass and of the one before; the latter are not read if
        beta is 0.
    """

    now: Floats
    before: Floats
    beta: np.floating


class Data(NamedTuple):
    """What the materialities are compared with.

    Parameters
    ----------
    rho
        (rows, pairs, planes, columns) similarities in units of 1 / full; 0 outside either frustum.
    full
        How many of these units are 1, in the type of the materialities.
    views, samples, first, origin
        As in `DisparitySpace`.
    """

    rho: NDArray[np.generic]
    full: np.floating
    views: int
    samples: int
    first: int
    origin: int


class Pairs(NamedTuple):
    """Which views are compared, in one of three ways; the others are None.

    Parameters
    ----------
    any_views
        (pairs, 2) views of each pair.
    links
        For consecutive views: a tuple with one element for each pair. One loop takes all of them.
    rest
        For consecutive views: a tuple with one element for each pair that remains after loops of `LINKS` pairs.
    """

    any_views: NDArray[np.int64] | None
    links: tuple[int, ...] | None
    rest: tuple[int, ...] | None


class Ties(NamedTuple):
    """How neighbouring points are tied (equation 8).

    Parameters
    ----------
    weights
        Edge weights down and right as from `edge_weights`, or None: no ties.
    across, along
        lambda_y and lambda_x for one unit of weight and slope.
    """

    weights: tuple[NDArray[np.uint8], NDArray[np.uint8]] | None
    across: np.floating
    along: np.floating


class Count(NamedTuple):
    """The count term's part of the slope of every point in a row: pressure (sum of mu - target) + bias.

    Parameters
    ----------
    ahead
        The beta of the pass after this one: `pass_rows` adds up where that one will begin, while it is in the cache.
        Below 0 nothing is added up.
    """

    pressure: float
    target: float
    bias: float
    ahead: float


class Room(NamedTuple):
    """Workspace of `pass_rows`; every thread needs one of its own.

    Parameters
    ----------
    ring
        (3, planes, columns + 2) the point in the rows y - 1, y and y + 1, with one more column at either end.
    marks
        (layers, views, samples) V of the nearest plane of every layer of planes.
    seen
        (depth, views, wide) V of one layer.
    behind, pulls
        (views, wide) A and the sums of r V of all pairs.
    line
        (2, columns) slopes and pulls of a plane.
    """

    ring: Floats
    marks: Floats
    seen: Floats
    behind: Floats
    pulls: Floats
    line: Floats

    @classmethod
    def of(cls, space: DisparitySpace, kind: np.dtype[np.floating]) -> "Room":
        """A workspace for scenes of that space and materialities of that type."""
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
        return cls(*(np.zeros(shape, kind) for shape in shapes))


@helper
def _extrapolate(now, before, beta, out):  # type: ignore[no-untyped-def]
    """out = now + beta (now - before), kept within [0, 1]. Returns its sum, as exact as energies of a plane."""
    zero, one = now.dtype.type(0), now.dtype.type(1)
    total = zero
    if beta == zero:  # at the start there is no pass before: what stands there may be anything
        for x in range(now.size):
            out[x] = now[x]
            total += now[x]
    else:
        for x in range(now.size):
            value = min(max(now[x] + beta * (now[x] - before[x]), zero), one)
            out[x] = value
            total += value
    return np.float64(total)


@helper
def _extrapolate_row(now, before, beta, out):  # type: ignore[no-untyped-def]
    """The same for all planes of a row. Only the middle columns of `out` are written if it is wider."""
    total = 0.0
    planes, columns = now.shape
    margin = (out.shape[1] - columns) // 2
    for k in range(planes):
        total += _extrapolate(now[k], before[k], beta, out[k, margin : margin + columns])
    return total


@kernel
def count_rows(point, top, end, counts):  # type: ignore[no-untyped-def]
    """Sums of the rows top..end of the point."""
    mu = np.empty(point.now.shape[1:], point.now.dtype)
    for y in range(top, end):
        counts[y] = _extrapolate_row(point.now[y], point.before[y], point.beta, mu)


@kernel
def border_rows(point, block, beyond):  # type: ignore[no-untyped-def]
    """The rows of the point just before and just after every `block` rows: (blocks, 2, planes, columns)."""
    for place in range(beyond.shape[0]):
        for side, y in enumerate((place * block - 1, (place + 1) * block)):
            if 0 <= y < point.now.shape[0]:
                _extrapolate_row(point.now[y], point.before[y], point.beta, beyond[place, side])


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


@inlined
def _pass_plane(  # type: ignore[no-untyped-def]
    y, k, above, here, below, rays, data, any_views, links, rest, weights, ties, room, step, offset, new, slopes, sums
):
    """Take in one plane of a row; `sums`, the energies of pairs and ties, with those of the plane added.

    What may be None is an argument of its own. Only then can the compiler leave out the code that works on it.
    """
    paired, tied = sums
    _, columns = above.shape
    columns -= 2
    mu, slope, pull = here[k, 1 : 1 + columns], room.line[0], room.line[1]
    zero = mu.dtype.type(0)
    if weights is not None:
        across, along = weights
        tied += tie(
            here[k], above[k], below[k], across[max(0, y - 1), k], across[y, k], along[y, k], ties.across, ties.along,
            slope,
        )  # fmt: skip
    elif links is None:
        fill(zero, slope)
    if links is not None:
        paired += chain(mu, rays, data.rho, data.full, y, k, 0, links, None, None, step, offset, new, slopes)
    if rest is not None:
        fill(zero, pull)
        for view in range(0, data.views - 1 - len(rest), LINKS):
            paired += chain(mu, rays, data.rho, data.full, y, k, view, GROUP, slope, pull, step, offset, None, None)
        view = data.views - 1 - len(rest)
        paired += chain(mu, rays, data.rho, data.full, y, k, view, rest, slope, pull, step, offset, new, slopes)
    if any_views is not None:
        paired += _match_pairs(
            mu, rays.seen, data.rho[y], k, any_views, rays.slide, data.origin, data.samples, data.full, room.pulls
        )
        margin = columns - data.samples
        for i in range(data.views):
            start = i * rays.slide - data.origin
            inside = slice(margin, margin + data.samples)
            shade(
                mu[start : start + data.samples],
                rays.seen[i, inside],
                slope[start : start + data.samples],
                room.pulls[i, inside],
                rays.behind[i, inside],
            )
        descend(mu, slope, y, k, step, offset, new, slopes)
    return paired, tied


@kernel
def pass_rows(point, data, pairs, ties, count, beyond, step, top, end, room, new, slopes, sums):  # type: ignore[no-untyped-def]
    """One pass over rows top..end: energies and gradient at the point, and the step from there.

    Parameters
    ----------
    point, data, pairs, ties, count, room
        `Point`, `Data`, `Pairs`, `Ties`, `Count` and `Room`.
    beyond
        (2, planes, columns) the point in the rows top - 1 and end; not read without ties.
    step
        Length of the step, for slopes in units of `full` / 2.
    new
        (rows, planes, columns), overwritten: the stepped materialities; may be `before`.
    slopes
        The same shape, overwritten with the slopes, in the same units; or None.
    sums
        (rows, 4), overwritten: E_data, the ties' E_smooth and the sum of mu of each row, and that of the next pass's
        point if it is added up (`Count`).
    """
    rows, planes, columns = point.now.shape
    kind = point.now.dtype.type
    zero, one = kind(0), kind(1)
    margin, origin = columns - data.samples, data.origin
    ring, marks, seen, behind = room.ring, room.marks, room.seen, room.behind
    depth = seen.shape[0]
    for y in range(top, end):
        for row in range(y - 1 if y == top else y + 1, y + 2):
            if top <= row < end:
                sums[row, 2] = _extrapolate_row(point.now[row], point.before[row], point.beta, ring[row % 3])
            elif ties.weights is not None and 0 <= row < rows:
                _extrapolate_row(beyond[int(row > y)], beyond[0], zero, ring[row % 3])
        above, here, below = ring[max(0, y - 1) % 3], ring[y % 3], ring[min(rows - 1, y + 1) % 3]
        offset = kind(count.pressure * (sums[y, 2] - count.target) + count.bias)
        energies, total = (0.0, 0.0), 0.0
        for i in range(data.views):
            fill(zero, behind[i])
        # `here` has a column more at either end
        mark_layers(here, data.first, origin - 1, one, depth, marks)
        for bottom in range(0, planes, depth):
            nearest = min(planes, bottom + depth)
            see_layer(here, marks[bottom // depth], bottom, nearest, data.first, origin - 1, one, margin, seen)
            for k in range(bottom, nearest):
                rays = Rays(seen[k - bottom], behind, margin + origin, data.first + k)
                energies = _pass_plane(
                    y, k, above, here, below, rays, data, pairs.any_views, pairs.links, pairs.rest, ties.weights,
                    ties, room, step, offset, new, slopes, energies,
                )  # fmt: skip
                if count.ahead >= 0:
                    total += _extrapolate(new[y, k], point.now[y, k], kind(count.ahead), room.line[0])
        sums[y, 0], sums[y, 1] = energies
        sums[y, 3] = total
