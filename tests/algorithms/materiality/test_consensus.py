"""The share of the rays that end at a point, against a walk over all of them."""

import numpy as np
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from materialities import SPACES

from matbench.algorithms.materiality.consensus import consensus
from matbench.space import DisparitySpace, Volume, visibility


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
