"""Where the map starts, against loops over all points."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from materialities import PAIR_SETS, SPACES, random_bytes

from matbench.algorithms.materiality.start import mean_similarity, soften
from matbench.algorithms.similarity import pairs


@settings(max_examples=20, deadline=None)
@given(SPACES, PAIR_SETS, st.integers(0, 999))
def test_starts_are_their_twins(space, which, seed):
    which = pairs(space.views, which, space.views // 2)
    rho, both, sees = random_bytes(space, which, np.random.default_rng(seed))
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
