"""Visibility, energy and gradient against brute force in float64."""

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.materiality import passes
from matbench.algorithms.materiality.binarize import PRIOR, by_plane, by_ray, seen_rays, visible_cost
from matbench.algorithms.materiality.consensus import consensus
from matbench.algorithms.materiality.edges import edge_weights
from matbench.algorithms.materiality.energy import see_row
from matbench.algorithms.materiality.objective import Energy
from matbench.algorithms.materiality.start import mean_similarity, soften
from matbench.algorithms.similarity import pairs
from matbench.space import DisparitySpace, Volume, visibility

SPACES = st.builds(
    lambda n, rows, width, first, extent, q: DisparitySpace(n, rows, width, first, first + extent, q),
    n=st.integers(2, 9),
    rows=st.integers(1, 3),
    width=st.integers(1, 6),
    first=st.integers(-3, 1),
    extent=st.integers(0, 4),
    q=st.integers(1, 2),
)
PAIR_SETS = st.sampled_from(["all", "consecutive", "reference"])


def ray_walk(mu, space, view):
    """(planes, columns) visibility of one row, walking from every point towards the camera (equations 2-4)."""
    seen = np.zeros(mu.shape)
    for k, c in np.ndindex(mu.shape):
        sample = c - space.start(view, k)
        if 0 <= sample < space.samples:
            seen[k, c] = np.prod([1 - mu[m, space.start(view, m) + sample] for m in range(k + 1, space.planes)])
    return seen


def data_energy(mu, rho, space, which):
    """Equation 6 of one row."""
    seen = [ray_walk(mu, space, view) for view in range(space.views)]
    return sum(((rho[p] - mu * seen[i] * seen[j]) ** 2).sum() for p, (i, j) in enumerate(which))


def random_row(space, which, seed, opaque=True):
    rng = np.random.default_rng(seed)
    mu = rng.random((space.planes, space.columns))
    if opaque:
        mu[rng.random(mu.shape) < 0.2] = 1
    rho = rng.random((len(which), space.planes, space.columns))
    for p, (i, j) in enumerate(which):
        for k in range(space.planes):
            inside = np.zeros((2, space.columns), bool)
            inside[0, space.frustum(i, k)] = inside[1, space.frustum(j, k)] = True
            rho[p, k, ~inside.all(axis=0)] = 0
    return mu, rho


def plain_energy(space, which, rho, scale=1.0):
    """E_data alone."""
    none = np.zeros((0, 0, 0), np.uint8)
    return Energy(space, which, rho, 1.0, 0.0, True, 0.0, 0.0, (none, none), scale)


def pass_over(energy, mu, threads=1):
    """E and dE/dmu at mu."""
    new, slopes = np.empty_like(mu), np.empty_like(mu)
    found = energy.step(mu, np.full_like(mu, np.nan), 0.0, 0.01, new, slopes, threads)
    np.testing.assert_allclose(new, np.clip(mu - 0.01 * slopes, 0, 1), atol=1e-6)
    return found["data"], slopes


@settings(max_examples=40, deadline=None)
@given(SPACES, PAIR_SETS, st.integers(0, 999))
def test_visibility_energy_and_gradient(space, which, seed):
    which = pairs(space.views, which, space.views // 2)
    rows = [random_row(space, which, seed + y) for y in range(space.rows)]
    mu, rho = (np.stack(part) for part in zip(*rows, strict=True))
    seen = np.empty((space.views, space.planes, space.samples))
    see_row(mu[0], space.first, space.origin, 1.0, seen)
    everywhere = mu.astype(np.float32)
    for view in range(space.views):
        expected = ray_walk(mu[0], space, view)
        known = visibility(Volume(space, everywhere, tuple(range(space.views))), view)[0]
        np.testing.assert_allclose(known, expected, atol=1e-6)
        for k in range(space.planes):
            np.testing.assert_allclose(seen[view, k], expected[k, space.frustum(view, k)], atol=1e-12)

    energy, slope = pass_over(plain_energy(space, which, rho), mu)
    assert energy == pytest.approx(sum(data_energy(*row, space, which) for row in rows), rel=1e-12, abs=1e-10)
    points = list(np.ndindex(mu.shape))
    for point in [points[m] for m in np.random.default_rng(seed).permutation(len(points))[:12]]:
        # E is quadratic in each single mu: central differences are exact, at mu = 1 as well
        y, high, low = point[0], mu[point[0]].copy(), mu[point[0]].copy()
        high[point[1:]] += 1e-3
        low[point[1:]] -= 1e-3
        rise = data_energy(high, rho[y], space, which) - data_energy(low, rho[y], space, which)
        assert slope[point] == pytest.approx(rise / 2e-3, abs=1e-8)


@pytest.mark.parametrize("which", ["all", "consecutive", "reference"])
@pytest.mark.parametrize("views", [2, 5, 6, 9])
def test_bytes_in_float32_agree_with_float64(which, views):
    space = DisparitySpace(views, 2, 20, -3, 4, 2)
    which = pairs(views, which, 1)
    mu, rho = (np.stack(part) for part in zip(*(random_row(space, which, seed) for seed in (0, 1)), strict=True))
    rho = np.rint(255 * rho).astype(np.uint8)
    exact, slope = pass_over(plain_energy(space, which, rho / 255), mu)
    energy, found = pass_over(plain_energy(space, which, rho, 1 / 255), mu.astype(np.float32))
    assert energy == pytest.approx(exact, rel=1e-5)
    np.testing.assert_allclose(found, slope, atol=1e-4)


@settings(max_examples=15, deadline=None)
@given(SPACES, PAIR_SETS, st.integers(1, 3), st.integers(0, 99))
def test_visibilities_kept_in_layers_change_nothing(space, which, depth, seed):
    which = pairs(space.views, which, space.views // 2)
    mu, rho = (part[None] for part in random_row(space, which, seed))
    space = DisparitySpace(space.views, 1, space.width, space.first, space.last, space.fineness)
    energy, slope = pass_over(plain_energy(space, which, rho), mu)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passes, "LAYER", depth * space.views * (2 * space.columns - space.samples))
        in_layers, slope_in_layers = pass_over(plain_energy(space, which, rho), mu)
    assert in_layers == energy
    np.testing.assert_array_equal(slope_in_layers, slope)


@settings(max_examples=15, deadline=None)
@given(SPACES, PAIR_SETS, st.booleans(), st.integers(0, 999))
def test_whole_energy_and_its_gradient(space, which, per_row, seed):
    which = pairs(space.views, which, space.views // 2)
    rng = np.random.default_rng(seed)
    rows = [random_row(space, which, seed + y) for y in range(space.rows)]
    mu, rho = (np.stack(part) for part in zip(*rows, strict=True))
    down = rng.integers(0, 256, space.shape, dtype=np.uint8)
    right = rng.integers(0, 256, (*space.shape[:2], space.columns + 1), dtype=np.uint8)
    right[..., [0, -1]] = 0
    energy = Energy(space, which, rho, 3.0, 0.3, per_row, 2.0, 1.5, (down, right), 1.0)

    def twin(at):
        data = sum(data_energy(at[y], rho[y], space, which) for y in range(space.rows))
        excess = at.sum(axis=(1, 2)) - 3.0 if per_row else [at.sum() - 3.0 * space.rows]
        count = 0.3 * np.sum(np.square(excess)) / (3.0 if per_row else 3.0 * space.rows)
        adjacent = (down[:-1] / 255 * 2.0 * np.diff(at, axis=0) ** 2).sum()
        adjacent += (right[..., 1:-1] / 255 * 1.5 * np.diff(at, axis=2) ** 2).sum()
        return data, count, adjacent

    before, new, slopes = rng.random(mu.shape), np.empty_like(mu), np.empty_like(mu)
    at = np.clip(mu + 0.5 * (mu - before), 0, 1)
    alone = []
    for threads in (1, 2):
        found = energy.step(mu, before, 0.5, 0.01, new, slopes, threads)
        # a pass that keeps slopes may be compiled to round otherwise
        in_place = before.copy()
        assert energy.step(mu, in_place, 0.5, 0.01, in_place, None, threads) == pytest.approx(found, rel=1e-12)
        np.testing.assert_allclose(in_place, new, rtol=1e-12, atol=1e-14)
        alone.append(in_place)
        assert [found[part] for part in ("data", "count", "adjacent")] == pytest.approx(twin(at), rel=1e-9, abs=1e-9)
        assert found["total"] == pytest.approx(sum(twin(at)), rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(new, np.clip(at - 0.01 * slopes, 0, 1), atol=1e-12)
    np.testing.assert_array_equal(*alone)
    points = list(np.ndindex(mu.shape))
    for point in [points[m] for m in rng.permutation(len(points))[:5]]:
        high, low = at.copy(), at.copy()
        high[point] += 1e-3
        low[point] -= 1e-3
        assert slopes[point] == pytest.approx((sum(twin(high)) - sum(twin(low))) / 2e-3, abs=1e-7)


@settings(max_examples=20, deadline=None)
@given(SPACES, PAIR_SETS, st.integers(0, 999))
def test_starts_and_reading_are_their_twins(space, which, seed):
    which = pairs(space.views, which, space.views // 2)
    rng = np.random.default_rng(seed)
    both = np.zeros((len(which), space.planes, space.columns), bool)
    sees = np.zeros((space.views, space.planes, space.columns), bool)
    for k in range(space.planes):
        for view in range(space.views):
            sees[view, k, space.frustum(view, k)] = True
    for p, (i, j) in enumerate(which):
        both[p] = sees[i] & sees[j]
    rho = rng.integers(0, 256, (space.rows, *both.shape), dtype=np.uint8) * both
    mean = np.empty(space.shape, np.float32)
    mean_similarity(rho, which, space.first, space.origin, space.samples, mean)
    expected = rho.sum(axis=1) / 255 / np.maximum(both.sum(axis=0), 1)
    np.testing.assert_allclose(mean, expected, atol=1e-6)

    soft, mu = np.exp(20 * (expected - 1)), np.zeros(space.shape)
    for view in range(space.views):
        rays = np.stack([soft[:, k, space.frustum(view, k)] for k in range(space.planes)])
        for k in range(space.planes):
            mu[:, k, space.frustum(view, k)] += rays[k] / rays.sum(axis=0)
    mu /= np.maximum(sees.sum(axis=0), 1)
    soften(mean, space.views, space.first, space.origin, space.samples, np.float32(20))
    np.testing.assert_allclose(mean, mu, rtol=2e-4, atol=1e-7)

    view, mu = int(rng.integers(space.views)), rng.random(space.shape, np.float32)
    seen = [np.stack([ray_walk(row, space, i) for row in mu]) for i in range(space.views)]
    reached = space.in_view(mu * seen[view], view).transpose(0, 2, 1)
    np.testing.assert_allclose(seen_rays(mu, space, view, 2), reached, atol=1e-6)

    # a plane does not hide the one behind it: V of the next plane on the same ray
    total, weight = np.full(space.shape, PRIOR * 0.6), np.full(space.shape, PRIOR)
    for p, (i, j) in enumerate(which):
        for k in range(space.planes):
            near = min(k + 1, space.planes - 1)
            pair = both[p, k].astype(float) * np.ones((space.rows, 1))
            for other in {i, j} - {view}:
                shifted = np.zeros((space.rows, space.columns))
                shifted[:, space.frustum(other, k)] = seen[other][:, near, space.frustum(other, near)]
                pair *= shifted
            total[:, k] += pair * (1 - rho[:, p, k] / 255)
            weight[:, k] += pair
    cost, material = visible_cost(mu, rho, space, which, view, 0.6, 2)
    np.testing.assert_allclose(cost, space.in_view(total / weight, view).transpose(0, 2, 1), atol=1e-5)
    np.testing.assert_array_equal(material, space.in_view(mu, view).transpose(0, 2, 1))


def consensus_twin(space, maps):
    """mu = (sum w + 0.05) / (sum V + 0.5), point by point; w = max(0, 1 - |k - d|), V = 1 - sum of w beyond k + 1."""
    ended, reached = np.full(space.shape, 0.05), np.full(space.shape, 0.5)
    for view, found in enumerate(maps.astype(float)):
        ends = np.maximum(0, 1 - np.abs(np.arange(space.planes) - found[..., None]))
        for k, u in np.ndindex(space.planes, space.samples):
            left, share = divmod(u, space.fineness)
            share /= space.fineness
            right = min(left + 1, space.width - 1)
            for volume, values in ((ended, ends[..., k]), (reached, 1 - ends[..., k + 2 :].sum(axis=2))):
                volume[:, k, space.start(view, k) + u] += (1 - share) * values[:, left] + share * values[:, right]
    return ended / reached


@settings(max_examples=25, deadline=None)
@given(SPACES, st.integers(1, 20), st.integers(1, 3), st.integers(0, 999))
def test_consensus_is_its_twin(space, rows, fineness, seed):
    space = evolve(space, rows=rows, fineness=fineness)
    rng = np.random.default_rng(seed)
    maps = (rng.random((space.views, space.rows, space.width)) * (space.planes - 1)).astype(np.float32)
    maps = np.where(rng.random(maps.shape) < 0.3, np.rint(maps), maps)
    one, two = (consensus(space, maps, threads) for threads in (1, 2))
    np.testing.assert_allclose(one, consensus_twin(space, maps), atol=2e-6)
    np.testing.assert_array_equal(two, one)
    assert one.dtype == np.float32
    assert 0 <= one.min() <= one.max() <= 1


def test_views_that_agree_leave_one_surface():
    # three views of a wall in plane 2
    space = DisparitySpace(3, 1, 12, 0, 4)
    mu = consensus(space, np.full((3, 1, 12), 2, np.float32))
    volume = Volume(space, mu, (0, 1, 2))
    solid = mu[0, 2, space.start(1, 2) + 2 : space.start(1, 2) + 10]
    assert (solid == np.float32(3.05) / np.float32(3.5)).all()
    for view in range(3):
        seen = space.in_view(visibility(volume, view), view)[0]
        assert seen[2].min() > 0.6, "what is before the wall hides nothing"
        assert seen[0, 4:8].max() < 0.15, "what is behind it is hidden, where all views see"


def test_edge_weights_are_means_over_the_views_that_see():
    space = DisparitySpace(2, 3, 4, 0, 1)
    rows = np.random.default_rng(0).random((2, 3, 3, 4), np.float32) * 50
    down, right = edge_weights(rows, space, 10.0)
    w = np.exp(-np.abs(np.diff(rows, axis=2)).mean(axis=1) / 10)
    # plane 1: view 1 starts one column later
    assert down[0, 1, 0] == round(255 * float(w[0, 0, 0]))
    assert down[0, 1, 2] == round(255 * float(w[0, 0, 2] + w[1, 0, 1]) / 2)
    w = np.exp(-np.abs(np.diff(rows, axis=3)).mean(axis=1) / 10)
    assert right[1, 0, 3] == round(255 * float(w[0, 1, 2] + w[1, 1, 2]) / 2)
    assert not right[..., [0, -1]].any()
    assert not down[-1].any()


def test_by_ray_takes_the_most_material_point_and_its_neighbours():
    seen = np.array([[[0, 0.2, 0.6, 0.2, 0], [0.5, 0, 0, 0, 0], [0, 0, 0, 0, 0]]], np.float32)
    np.testing.assert_allclose(by_ray(seen), [[2, 0, np.nan]])


def test_by_plane_keeps_n_points_and_takes_the_nearest():
    space = DisparitySpace(2, 1, 2, 0, 2)
    mu = np.zeros(space.shape, np.float32)
    mu[0, 0, space.start(0, 0)] = 0.9
    mu[0, 2, space.start(0, 2)] = 0.8
    mu[0, 1, space.start(0, 1) + 1] = 0.1
    np.testing.assert_array_equal(by_plane(mu, space, 0, 2), [[2, np.nan]])
    np.testing.assert_array_equal(by_plane(mu, space, 0, 1), [[0, np.nan]])
    np.testing.assert_array_equal(by_plane(mu, space, 0, 9), [[2, 1]])
