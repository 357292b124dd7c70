"""One cost per pixel and plane against plain sorting."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.fusion import better_half, seen_from, view_cost
from matbench.algorithms.similarity import Matcher, Matching
from matbench.scene import Range, Scene


def random_matcher(n, height=3, width=6, least=-1.0, largest=2.0, seed=0, **settings):
    views = np.random.default_rng(seed).integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    scene = Scene("random", views, tuple(map(str, range(n))), n // 2, Range(least, largest), {}, 1.0)
    return Matcher.of(scene, Matching(views=0, **settings))


def both_see(matcher):
    """(pairs, planes, columns): where both views of a pair see a point."""
    space = matcher.space
    inside = np.zeros((space.views, space.planes, space.columns), bool)
    for view, k in np.ndindex(inside.shape[:2]):
        inside[view, k, space.frustum(view, k)] = True
    return np.stack([inside[i] & inside[j] for i, j in matcher.pairs])


@settings(max_examples=25, deadline=None)
@given(
    n=st.integers(2, 6),
    which=st.sampled_from(["all", "consecutive", "reference"]),
    least=st.integers(-2, 1),
    fineness=st.integers(1, 3),
    seed=st.integers(0, 99),
)
def test_cost_is_one_less_the_better_half(n, which, least, fineness, seed):
    matcher = random_matcher(n, 3, 6, least, least + 2, seed, pairs=which, fineness=fineness)
    space, rho, known = matcher.space, matcher.all() / 255, both_see(matcher)
    mean = np.empty(space.shape, np.float32)
    spans = np.stack([matcher.spans(i, j) for i, j in matcher.pairs])
    better_half(matcher.all(), spans[..., 0].copy(), spans[..., 0] + spans[..., 1], mean)
    expected = np.zeros(space.shape)
    for y, k, x in np.ndindex(space.shape):
        ranked = np.sort(rho[y, known[:, k, x], k, x])[::-1]
        if ranked.size:
            expected[y, k, x] = np.mean(ranked[: (ranked.size + 1) // 2])
    np.testing.assert_allclose(mean, expected, atol=1e-6)

    view = matcher.scene.ref
    known = np.stack([space.in_view(pair[None], view)[0] for pair in known])
    rays = matcher.rays(matcher.phases(), 0, space.rows)
    assert matcher.ray_comparisons == space.rows * known.sum()
    every = np.stack([space.in_view(part, view) for part in np.moveaxis(matcher.all(), 1, 0)], axis=1)
    inner = slice(None) if which == "reference" else slice(1, -1)  # windows end where the reference does
    np.testing.assert_array_equal(rays[..., inner], every[..., inner])
    best = np.full((space.rows, space.width, space.planes), np.nan)
    for y, x, k in np.ndindex(best.shape):
        ranked = np.sort(rays[y, known[:, k, x], k, x] / 255)[::-1]
        if ranked.size:
            best[y, x, k] = 1 - np.mean(ranked[: (ranked.size + 1) // 2])
    for threads in (1, 2):
        np.testing.assert_allclose(view_cost(matcher, threads), best, atol=1e-6)


@pytest.mark.parametrize("view", [0, 3])
def test_seen_from_another_view_that_view_is_in_every_pair(view):
    matcher = seen_from(random_matcher(4), view)
    assert matcher.scene.ref == view
    assert len(matcher.pairs) == 3
    assert (matcher.pairs == view).any(axis=1).all()
