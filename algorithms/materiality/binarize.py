"""From a fuzzy map of materialities to the disparities of the reference view."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel
from matbench.algorithms.materiality.energy import see_row
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import FULL
from matbench.space import DisparitySpace

PRIOR = 0.25  # weight of `hidden` in the mean cost of a point, as against 1 for a pair that sees the point


@kernel
def _seen_rays(mu, view, first, origin, fineness, top, end, seen):  # type: ignore[no-untyped-def]
    one = np.float32(1)
    planes, width = seen.shape[2], seen.shape[1]
    for y in range(top, end):
        for x in range(width):
            through = one
            for k in range(planes - 1, -1, -1):
                point = mu[y, k, view * (first + k) - origin + x * fineness]
                seen[y, x, k] = point * through
                through *= one - point


def seen_rays(mu: NDArray[np.float32], space: DisparitySpace, view: int, threads: int = 1) -> NDArray[np.float32]:
    """(H, W, planes) float32 mu V_view on the pixel rays of a view: where each ray ends. Sums along a ray are <= 1."""
    seen = np.empty((space.rows, space.width, space.planes), np.float32)
    over_rows(
        lambda top, end: _seen_rays(mu, view, space.first, space.origin, space.fineness, top, end, seen),
        space.rows,
        threads,
    )
    return seen


def by_ray(seen: NDArray[np.float32]) -> NDArray[np.float32]:
    """(H, W) float32 plane index where each ray most likely ends; NaN where nothing is material along it.

    The winner is the plane of the largest mu V; the answer is the centroid of mu V over it and its two neighbours.

    Parameters
    ----------
    seen
        (H, W, planes) from `seen_rays`.
    """
    planes = seen.shape[2]
    best = np.argmax(seen, axis=2)
    found = best.astype(np.float32)
    near = np.stack([np.clip(best + d, 0, planes - 1) for d in (-1, 0, 1)], axis=2)
    weights = np.take_along_axis(seen, near, axis=2)
    total = weights.sum(axis=2)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = (weights * near).sum(axis=2) / total
    return np.where(weights[..., 1] > 0, found, np.float32(np.nan)).astype(np.float32)


def by_plane(mu: NDArray[np.float32], space: DisparitySpace, view: int, target: float) -> NDArray[np.float32]:
    """(H, W) float32 plane index of the nearest point on each ray, among the `target` most material points.

    These are chosen for each epipolar plane on its own, as in the paper. NaN where a ray meets none of them.
    Among points of equal materiality, the nearer ones are chosen first.
    """
    found = np.full((space.rows, space.width), np.nan, np.float32)
    count = min(round(target), space.planes * space.columns)
    for y in range(space.rows):
        nearest_first = mu[y, ::-1].ravel()
        kept = np.zeros(nearest_first.size, bool)
        kept[np.argsort(-nearest_first, kind="stable")[:count]] = True
        kept &= nearest_first > 0
        solid = kept.reshape(mu[y].shape)[::-1]
        for k in range(space.planes):  # far to near: the nearest stays
            found[y, solid[k, space.frustum(view, k)][:: space.fineness]] = k
    return found


@kernel
def _visible_cost(mu, rho, pairs, views, view, first, origin, fineness, hidden, prior, top, end, cost, material):  # type: ignore[no-untyped-def]
    _, planes, width = cost.shape
    samples = (width - 1) * fineness + 1
    seen = np.empty((views, planes, samples), np.float32)
    one, scale = np.float32(1), np.float32(1 / FULL)
    for y in range(top, end):
        see_row(mu[y], first, origin, one, seen)
        for k in range(planes):
            for x in range(width):
                column = view * (first + k) - origin + x * fineness
                near = min(k + 1, planes - 1)
                total, weight = prior * hidden, prior
                for p in range(pairs.shape[0]):
                    i, j = pairs[p, 0], pairs[p, 1]
                    ui, uj = column - (i * (first + k) - origin), column - (j * (first + k) - origin)
                    if 0 <= ui < samples and 0 <= uj < samples:
                        both = one
                        if i != view:
                            both *= seen[i, near, ui]
                        if j != view:
                            both *= seen[j, near, uj]
                        total += both * (one - scale * rho[y, p, k, column])
                        weight += both
                cost[y, k, x] = total / weight
                material[y, k, x] = mu[y, k, column]


def visible_cost(
    mu: NDArray[np.float32],
    rho: NDArray[np.uint8],
    space: DisparitySpace,
    pairs: NDArray[np.int64],
    view: int,
    hidden: float,
    threads: int = 1,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Cost on the pixel rays of a view, from the other views that see the points.

    cost(s) = (sum over pairs V_ij (1 - rho_ij) + PRIOR hidden) / (sum over pairs V_ij + PRIOR).
    V_ij is the product of the visibilities of i and j. That of `view` itself is left out: all points of its
    ray are candidates. A plane does not hide the plane just behind it, because surfaces may lie between the two.

    Parameters
    ----------
    mu
        (rows, planes, columns) materialities.
    rho
        (rows, pairs, planes, columns) similarities in 255ths.
    hidden
        The cost of a point that no pair sees.

    Returns
    -------
    cost, material
        (H, planes, W) float32: the cost, and mu on the same rays.
    """
    cost = np.empty((space.rows, space.planes, space.width), np.float32)
    material = np.empty_like(cost)
    q, kind = space.fineness, np.float32

    def fill(top: int, end: int) -> None:
        _visible_cost(
            mu, rho, pairs, space.views, view, space.first, space.origin, q, kind(hidden), kind(PRIOR), top, end, cost,
            material,
        )  # fmt: skip

    over_rows(fill, space.rows, threads)
    return cost, material
