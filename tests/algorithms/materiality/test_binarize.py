"""Disparities read from materialities."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from materialities import PAIR_SETS, SPACES, random_bytes, ray_walk

from matbench.algorithms.materiality.binarize import PRIOR, by_plane, by_ray, seen_rays, visible_cost
from matbench.algorithms.similarity import pairs
from matbench.space import DisparitySpace


@settings(max_examples=20, deadline=None)
@given(SPACES, PAIR_SETS, st.integers(0, 999))
def test_readings_are_their_twins(space, which, seed):
    which = pairs(space.views, which, space.views // 2)
    rng = np.random.default_rng(seed)
    rho, both, _ = random_bytes(space, which, rng)
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
    np.testing.assert_allclose(cost, space.in_view(total / weight, view), atol=1e-5)
    np.testing.assert_array_equal(material, space.in_view(mu, view))


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
