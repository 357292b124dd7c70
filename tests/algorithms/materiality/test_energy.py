"""Visibility, energy and gradient of one row against brute force in float64."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from materialities import PAIR_SETS, SPACES, data_energy, pass_over, plain_energy, random_row, ray_walk

from matbench.algorithms.materiality.energy import see_row
from matbench.algorithms.similarity import pairs
from matbench.space import Volume, visibility


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
