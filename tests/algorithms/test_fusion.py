"""One cost per pixel and plane against plain sums over pairs and windows."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from window_means import supported

from matbench.algorithms.fusion import Fusion, better_half
from matbench.algorithms.similarity import Matcher, Matching
from matbench.scene import Range, Scene

SCENES = {
    "n": st.integers(2, 6),
    "height": st.sampled_from([1, 2, 4, 18]),
    "width": st.integers(1, 6),
    "least": st.integers(-2, 1),
    "extent": st.integers(0, 2),
    "fineness": st.integers(1, 3),
    "which": st.sampled_from(["all", "consecutive", "reference"]),
    "window": st.sampled_from([1, 3, 5]),
    "adaptive": st.sampled_from([0.0, 40.0]),
    "seed": st.integers(0, 99),
}


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


def seen(matcher, maps, view, j, k, x):
    """Per row, V and w of view j at the point of plane k on the ray of a pixel of `view`; 0 beyond its frustum."""
    space, q = matcher.space, matcher.space.fineness
    if j == view:
        return 1.0, 0.0
    sample = x * q - (j - view) * (space.first + k)
    if not 0 <= sample < space.samples:
        return 0.0, 0.0
    whole, rest = divmod(sample, q)
    ends = maps[j, :, whole + (2 * rest > q)].astype(float)
    shares = np.maximum(0, 1 - np.abs(np.arange(space.planes)[:, None] - ends))
    return 1 - shares[k + 2 :].sum(axis=0), shares[k]


def seen_cost_twin(matcher, maps, hidden, window):
    space, view = matcher.space, matcher.scene.ref
    rho = matcher.rays(matcher.phases(), 0, space.rows, window) / 255
    cost, mu = np.empty((2, space.rows, space.planes, space.width))
    for k, x in np.ndindex(cost.shape[1:]):
        rays = [seen(matcher, maps, view, j, k, x) for j in range(space.views)]
        total, weight = 0.5 * hidden, 0.5
        for p, (i, j) in enumerate(matcher.pairs):
            both = rays[i][0] * rays[j][0]
            total, weight = total + both * (1 - rho[:, p, k, x]), weight + both
        cost[:, k, x] = total / weight
        others = [ray for j, ray in enumerate(rays) if j != view]
        mu[:, k, x] = (sum(w for _, w in others) + 0.05) / (sum(v for v, _ in others) + 0.5)
    return cost, mu


@settings(max_examples=25, deadline=None)
@given(
    count=st.integers(1, 8),
    shape=st.tuples(st.integers(1, 3), st.integers(1, 3), st.integers(1, 9)),
    hidden=st.sampled_from([0.0, 0.72, 1.5]),
    seed=st.integers(0, 999),
)
def test_better_half_is_the_mean_of_the_most_similar(count, shape, hidden, seed):
    rng = np.random.default_rng(seed)
    rows, planes, columns = shape
    low = rng.integers(0, columns + 1, (count, planes))
    high = np.minimum(columns, low + rng.integers(0, columns + 1, (count, planes)))
    here = np.arange(columns)
    known = (low[..., None] <= here) & (here < high[..., None])
    rho = rng.integers(0, 256, (rows, count, planes, columns), dtype=np.uint8) * known
    cost = np.full(shape, np.nan, np.float32)
    better_half(rho, low, high, np.float32(hidden), cost)
    for y, k, x in np.ndindex(shape):
        ranked = np.sort(rho[y, known[:, k, x], k, x] / 255)[::-1]
        expected = 1 - np.mean(ranked[: (ranked.size + 1) // 2]) if ranked.size else hidden
        assert cost[y, k, x] == pytest.approx(expected, abs=1e-6)


@settings(max_examples=20, deadline=None)
@given(**SCENES)
def test_first_cost_is_one_less_the_better_half(
    n, height, width, least, extent, fineness, which, window, adaptive, seed
):
    matcher = random_matcher(
        n, height, width, least, least + extent, seed, pairs=which, fineness=fineness, window=window
    )
    space, view = matcher.space, matcher.scene.ref
    known = np.stack([space.in_view(pair[None], view)[0] for pair in both_see(matcher)])
    rays = matcher.rays(matcher.phases(), 0, space.rows)
    assert matcher.ray_comparisons == space.rows * known.sum()
    every = np.stack([space.in_view(part, view) for part in np.moveaxis(matcher.all(), 1, 0)], axis=1)
    # windows end where the reference does
    inner = slice(None) if which == "reference" else slice(window // 2, max(window // 2, space.width - window // 2))
    np.testing.assert_array_equal(rays[..., inner], every[..., inner])

    if adaptive:
        rays = matcher.rays(matcher.phases(), 0, space.rows, 1)
    expected = np.full((space.rows, space.planes, space.width), 0.6)
    for y, k, x in np.ndindex(expected.shape):
        ranked = np.sort(rays[y, known[:, k, x], k, x] / 255)[::-1]
        if ranked.size:
            expected[y, k, x] = 1 - np.mean(ranked[: (ranked.size + 1) // 2])
    if adaptive:
        expected = supported(expected, matcher.scene.views[view], window // 2, adaptive)
    one, two = (Fusion(adaptive=adaptive, hidden=0.6).first_cost(matcher, threads) for threads in (1, 2))
    np.testing.assert_allclose(one, expected, atol=2e-6)
    np.testing.assert_array_equal(two, one)


@settings(max_examples=20, deadline=None)
@given(**SCENES)
def test_seen_cost_is_its_equation(n, height, width, least, extent, fineness, which, window, adaptive, seed):
    matcher = random_matcher(
        n, height, width, least, least + extent, seed, pairs=which, fineness=fineness, window=window
    )
    view = seed % n
    matcher = matcher.with_reference(view)
    space, rng = matcher.space, np.random.default_rng(seed)
    maps = (rng.random((n, space.rows, space.width)) * (space.planes - 1)).astype(np.float32)
    maps = np.where(rng.random(maps.shape) < 0.3, np.rint(maps), maps)
    cost, mu = seen_cost_twin(matcher, maps, 0.6, 1 if adaptive else window)
    if adaptive:
        cost = supported(cost, matcher.scene.views[view], window // 2, adaptive)
    fusion = Fusion(adaptive=adaptive, hidden=0.6)
    one, two = (fusion.seen_cost(matcher, maps, threads) for threads in (1, 2))
    np.testing.assert_allclose(one[0], cost, atol=5e-6)
    np.testing.assert_allclose(one[1], mu, atol=2e-6)
    assert 0 < one[1].min() <= one[1].max() < 1
    for first, second in zip(one, two, strict=True):
        np.testing.assert_array_equal(second, first)


def test_a_view_that_ends_before_a_point_says_nothing_about_it():
    matcher = random_matcher(3, 2, 9, 0, 4, pairs="reference", fineness=1, window=1)
    fusion = Fusion(adaptive=0, hidden=0.4)
    far = np.zeros((3, 2, 9), np.float32)
    near = far + 4
    cost, mu = fusion.seen_cost(matcher, near)
    # two planes behind and farther nothing is seen, at the next everything
    np.testing.assert_allclose(cost[:, :3], 0.4, atol=1e-6)
    np.testing.assert_allclose(mu[:, :3], 0.1, atol=1e-6)
    assert mu[:, 4, 4] == pytest.approx((2 + 0.05) / (2 + 0.5))
    assert mu[:, 3, 4] == pytest.approx(0.05 / 2.5)
    np.testing.assert_array_equal(cost[:, 3:, 4], fusion.seen_cost(matcher, far)[0][:, 3:, 4])


@pytest.mark.parametrize("view", [0, 3])
def test_another_reference_view_is_in_every_pair(view):
    matcher = random_matcher(4).with_reference(view)
    assert matcher.scene.ref == view
    assert len(matcher.pairs) == 3
    assert (matcher.pairs == view).any(axis=1).all()


@pytest.mark.parametrize("name", ["adaptive", "hidden"])
def test_a_wrong_value_names_the_parameter(name):
    with pytest.raises(ValueError, match=name):
        Fusion(**{name: -1.0})


def test_threads_that_find_the_same_rows_do_not_disturb_one_another():
    matcher = random_matcher(3, 64, 40, 0, 4, pairs="reference", fineness=1, window=3, similarity="mixed")
    maps = np.random.default_rng(1).uniform(0, 4, (3, 64, 40)).astype(np.float32)
    alone = Fusion().seen_cost(matcher, maps, 1)
    for _ in range(300):
        for found, expected in zip(Fusion().seen_cost(matcher, maps, 2), alone, strict=True):
            np.testing.assert_array_equal(found, expected)
