"""Visibility, energy, exact gradient and step of one epipolar plane (equations 3, 6-10), in float32 or float64.

Arrays of a row: `mu` (planes, columns) over the target points; what belongs to a view lies in its
own samples, so that a ray keeps its place from plane to plane. View i starts in plane k at column
start = i (first + k) - origin, so column x is its sample x - start. Rows of a view have a `margin` of
zeros at both ends: there any column is a sample of any view, the frustum (equation 4) is where V is
not 0, and nothing branches. Offsets are unsigned: signed ones might count from an array's end, which
the compiler would have to watch.

Residuals are kept in units of rho, so that bytes are read as they are: with `full` such units to 1,
r = full mu V_i V_j - rho, slopes are full / 2 dE/dmu and energies full^2 E.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, kernel


class Rays(NamedTuple):
    """The rays of all views in one plane of a row.

    Parameters
    ----------
    seen, behind
        (views, wide) V and A of equations 3, 9 and 10.
    place, slide
        Column 0 of the plane is sample `place` in the row of view 0, and `slide` less in that of every next view.
    """

    seen: NDArray[np.floating]
    behind: NDArray[np.floating]
    place: int
    slide: int


@helper
def copy(values, row):  # type: ignore[no-untyped-def]
    """row = values."""
    for x in range(row.size):
        row[x] = values[x]


@helper
def _dim(through, mu, one, beyond):  # type: ignore[no-untyped-def]
    """The visibility one plane further away: V (1 - mu)."""
    for x in range(through.size):
        beyond[x] = through[x] * (one - mu[x])


@helper
def _dim_more(mu, one, through):  # type: ignore[no-untyped-def]
    """The same in place."""
    for x in range(through.size):
        through[x] *= one - mu[x]


@kernel
def see_row(mu, first, origin, one, seen):  # type: ignore[no-untyped-def]
    """V_i(s) = product of (1 - mu) over the nearer points on the ray (equation 3), near to far.

    Parameters
    ----------
    mu
        (planes, columns) materialities.
    seen
        (views, planes, samples), overwritten: their visibilities.
    """
    views, planes, samples = seen.shape
    for i in range(views):
        fill(one, seen[i, planes - 1])
        for k in range(planes - 1, 0, -1):
            start = i * (first + k) - origin
            _dim(seen[i, k], mu[k, start : start + samples], one, seen[i, k - 1])


@helper
def mark_layers(mu, first, origin, one, depth, marks):  # type: ignore[no-untyped-def]
    """V of the nearest plane of every `depth` planes: marks (layers, views, samples), overwritten."""
    layers, views, samples = marks.shape
    for i in range(views):
        fill(one, marks[layers - 1, i])
        for layer in range(layers - 1, 0, -1):
            through = marks[layer - 1, i]
            copy(marks[layer, i], through)
            for k in range(min((layer + 1) * depth, mu.shape[0]) - 1, layer * depth - 1, -1):
                start = i * (first + k) - origin
                _dim_more(mu[k, start : start + samples], one, through)


@helper
def see_layer(mu, mark, bottom, top, first, origin, one, margin, seen):  # type: ignore[no-untyped-def]
    """V of the planes bottom..top of a row from that of plane top - 1, into `seen` (depth, views, wide)."""
    views, samples = mark.shape
    for i in range(views):
        copy(mark[i], seen[top - 1 - bottom, i, margin : margin + samples])
        for k in range(top - 1, bottom, -1):
            start = i * (first + k) - origin
            _dim(
                seen[k - bottom, i, margin : margin + samples],
                mu[k, start : start + samples],
                one,
                seen[k - bottom - 1, i, margin : margin + samples],
            )


@helper
def chain(mu, rays, rho, full, y, k, view, links, slope, pull, step, bias, new, slopes):  # type: ignore[no-untyped-def]
    """Consecutive pairs of one plane from `view` on, as many as the tuple `links` is long, in one loop over x.

    At every point, view after view: r = full mu V_i V_j - rho; the slope gains r V_i V_j - V_i A_i;
    A_i = g_i + (1 - mu) A_i with g_i = mu (r' V_h + r V_j), h and r' being those of the pair before.

    Parameters
    ----------
    mu, slope
        (columns,) of this plane. A `slope` of None starts at 0.
    rays
        `Rays` of the plane; A of those views is overwritten with that of the next plane.
    rho
        (rows, pairs, planes, columns), of which row y and plane k count.
    pull
        (columns,) r V: that of the pair before on entry, that of the last pair on return. None starts at 0.
    new, slopes
        (rows, planes, columns). If `new` is given, the last view is finished as well: the stepped point is
        written there, and its slope to `slopes` unless that is None. Otherwise slope and pull are handed on.

    Returns
    -------
    Sum of r^2.
    """
    # the compiler knows the length of a tuple, and so keeps all views of a point in registers
    kind = mu.dtype.type
    zero, one = kind(0), kind(1)
    seen, behind, place, slide = rays
    energy = zero
    for x in range(np.uintp(mu.size)):
        m = mu[x]
        at = x + np.uintp(place - view * slide)
        v = seen[view, at]
        gained = zero if slope is None else slope[x]
        before = zero if pull is None else pull[x]
        for link in range(len(links)):
            i = view + link
            beside = x + np.uintp(place - (i + 1) * slide)
            w = seen[i + 1, beside]
            both = v * w
            r = full * m * both - kind(rho[y, i, k, x])
            energy += r * r
            a = behind[i, at]
            gained += r * both - v * a
            behind[i, at] = a + m * (before + r * w - a)
            before = r * v
            at, v = beside, w
        if new is None:
            if slope is not None:
                slope[x] = gained
            if pull is not None:
                pull[x] = before
        else:
            i = view + len(links)
            a = behind[i, at]
            gained -= v * a
            behind[i, at] = a + m * (before - a)
            new[y, k, x] = min(max(m - step * (gained + bias), zero), one)
            if slopes is not None:
                slopes[y, k, x] = gained + bias
    return energy


@helper
def match(mu, vi, vj, rho, full, pull_i, pull_j):  # type: ignore[no-untyped-def]
    """Any pair in one plane: `pull_i` gains r V_j and `pull_j` r V_i. Returns the sum of r^2."""
    kind = mu.dtype.type
    energy = kind(0)
    for x in range(mu.size):
        r = full * mu[x] * vi[x] * vj[x] - kind(rho[x])
        energy += r * r
        pull_i[x] += r * vj[x]
        pull_j[x] += r * vi[x]
    return energy


@helper
def shade(mu, through, slope, pull, behind):  # type: ignore[no-untyped-def]
    """Finish one view after all its pairs: A = g + (1 - mu) A. Its pull is then used up and set to 0.

    The slope gains r V_i V_j of a pair in two halves, one with each of its views.
    """
    zero, half = mu.dtype.type(0), mu.dtype.type(0.5)
    for x in range(mu.size):
        g, a = pull[x], behind[x]
        slope[x] += through[x] * (half * g - a)
        behind[x] = a + mu[x] * (g - a)
        pull[x] = zero


@helper
def descend(mu, slope, y, k, step, bias, new, slopes):  # type: ignore[no-untyped-def]
    """new = mu - step (slope + bias), kept within [0, 1], in row y and plane k; `slopes` = slope + bias or None."""
    zero, one = mu.dtype.type(0), mu.dtype.type(1)
    out = new[y, k]
    for x in range(mu.size):
        out[x] = min(max(mu[x] - step * (slope[x] + bias), zero), one)
    if slopes is not None:
        for x in range(mu.size):
            slopes[y, k, x] = slope[x] + bias


@helper
def tie(mu, above, below, w_above, w_below, w_along, across, along, slope):  # type: ignore[no-untyped-def]
    """The part of E_smooth (equation 8) that ties one plane of a row to the next row, and its columns to one another.

    Parameters
    ----------
    mu, above, below
        (columns + 2,) materialities of rows y, y - 1 and y + 1, with one more column at either end. Beyond
        the image's border, those of row y itself.
    w_above, w_below
        (columns,) uint8 edge weights between y - 1 and y, y and y + 1.
    w_along
        (columns + 1,) those between x - 1 and x; 0 at the ends.
    across, along
        lambda_y and lambda_x for one unit of weight and slope.
    slope
        (columns,), overwritten: half the derivative.

    Returns
    -------
    across sum w (mu(y + 1) - mu(y))^2 + along sum w (mu(x + 1) - mu(x))^2.
    """
    kind = mu.dtype.type
    energy = kind(0)
    before, here, after = mu[:-2], mu[1:-1], mu[2:]
    up, down, w_before, w_after = above[1:-1], below[1:-1], w_along[:-1], w_along[1:]
    for x in range(slope.size):
        m = here[x]
        fall, rise = m - down[x], m - after[x]
        next_row, next_column = across * kind(w_below[x]) * fall, along * kind(w_after[x]) * rise
        energy += next_row * fall + next_column * rise
        slope[x] = (
            next_row
            + next_column
            + across * kind(w_above[x]) * (m - up[x])
            + along * kind(w_before[x]) * (m - before[x])
        )
    return energy
