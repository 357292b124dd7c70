"""Support by colour, and costs of some rows at a time against those of all rows at once."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from window_means import supported

from matbench.algorithms.agreement import agreement
from matbench.algorithms.fusion import Fusion
from matbench.algorithms.room import Room
from matbench.algorithms.similarity import Matcher, Matching
from matbench.algorithms.support import support
from matbench.scene import Range, Scene


def random_matcher(n, height=3, width=6, least=-1.0, largest=2.0, seed=0, **settings):
    views = np.random.default_rng(seed).integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    scene = Scene("random", views, tuple(map(str, range(n))), n // 2, Range(least, largest), {}, 1.0)
    return Matcher.of(scene, Matching(views=0, **settings))


@settings(max_examples=20, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 6), st.integers(1, 4), st.integers(1, 6)),
    radius=st.integers(0, 2),
    adaptive=st.sampled_from([2.0, 30.0, 1e6]),
    seed=st.integers(0, 999),
)
def test_support_is_a_weighted_mean_of_the_window(shape, radius, adaptive, seed):
    rng = np.random.default_rng(seed)
    cost, image = rng.random(shape, np.float32), rng.integers(0, 256, (*shape[::2], 3), dtype=np.uint8)
    fall = np.exp(-np.arange(256) / adaptive).astype(np.float32)
    expected = supported(cost, image, radius, adaptive)
    first = int(rng.integers(shape[0]))
    end = int(rng.integers(first, shape[0])) + 1
    top, bottom = max(0, first - radius), min(shape[0], end + radius)
    out = np.full((end - first, *shape[1:]), np.nan, np.float32)
    support(cost[top:bottom].copy(), image, first, first - top, fall, radius, out)
    np.testing.assert_allclose(out, expected[first:end], atol=1e-6)


def test_support_stays_on_its_side_of_an_edge():
    image = np.zeros((5, 8, 3), np.uint8)
    image[:, 4:, 1] = 200
    cost = np.broadcast_to(np.arange(8) >= 4, (5, 1, 8)).astype(np.float32)
    fall = np.exp(-np.arange(256) / 10).astype(np.float32)
    out = np.empty_like(cost)
    support(cost, image, 0, 0, fall, 2, out)
    np.testing.assert_allclose(out, cost, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(
    height=st.sampled_from([1, 3, 18, 40]),
    window=st.sampled_from([1, 3, 5]),
    adaptive=st.sampled_from([0.0, 40.0]),
    charged=st.sampled_from([0.0, 0.25]),
    visibility=st.booleans(),
    seed=st.integers(0, 99),
)
def test_costs_in_whole_numbers_are_the_real_ones_with_what_is_not_material(
    height, window, adaptive, charged, visibility, seed
):
    matcher = random_matcher(3, height, 7, 0, 3, seed, pairs="reference", fineness=1, window=window)
    space, fusion, unit = matcher.space, Fusion(adaptive=adaptive, hidden=0.6), 4095.0
    maps = np.random.default_rng(seed).uniform(0, 3, (3, height, 7)).astype(np.float32)
    cost, mu = fusion.seen_cost(matcher, maps)
    if not visibility:
        cost, mu = fusion.first_cost(matcher), agreement(matcher, maps)
    expected = (cost + np.float32(charged) * (1 - mu)).astype(float)
    assert expected.max() <= fusion.largest(charged) + 1e-5
    costs, found = fusion.seen(matcher, matcher.phases(), maps, charged, visibility), {}
    for threads in (1, 2):
        found[threads] = np.full((height + 1, space.planes, 8), 7, np.uint16)
        costs.whole(unit, found[threads], Room(), threads)
    np.testing.assert_allclose(found[1][:height, :, :7], expected * unit, atol=0.51)
    np.testing.assert_array_equal(found[1], found[2])
    assert (found[1][height:] == 7).all()
    assert (found[1][..., 7:] == 7).all()
