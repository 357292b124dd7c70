"""Similarities of single pixels against those of windows of one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbours import random_scene

from matbench.algorithms.agreement import ENDED, PRIOR
from matbench.algorithms.fusion import weigh_seen
from matbench.algorithms.pixels import most_costly, weigh_pixels
from matbench.algorithms.similarity import Matcher, Matching


@settings(max_examples=25, deadline=None)
@given(
    n=st.integers(2, 4),
    height=st.integers(1, 4),
    width=st.sampled_from([1, 2, 7, 31, 33, 70]),
    least=st.integers(-2, 1),
    extent=st.integers(0, 3),
    fineness=st.integers(1, 3),
    which=st.sampled_from(["all", "consecutive", "reference"]),
    truncation=st.sampled_from([0.0, 20.0, 250.0]),
    colour=st.booleans(),
    most=st.sampled_from([0.0, 30.5, 100.5]),
    seed=st.integers(0, 99),
)
def test_a_pixel_is_a_window_of_one(n, height, width, least, extent, fineness, which, truncation, colour, most, seed):
    scene = random_scene(n, height, width, least, least + extent, seed)
    how = Matching(views=0, fineness=fineness, pairs=which, window=1, truncation=truncation, colour=colour, alike=most)
    matcher = Matcher.of(scene, how)
    rho = matcher.rays(matcher.phases(), 0, height)
    windows = np.zeros_like(rho)
    matcher._compare(matcher.phases(), 0, windows, on_rays=True)
    assert np.abs(rho.astype(int) - windows).max() <= 1  # at halves of a byte they may round to either side
    if rho.size > 3000:
        assert (rho != windows).mean() < 0.01


@pytest.mark.parametrize(("channels", "truncation", "most"), [(3, 20.0, 3840), (1, 20.0, 1280), (3, 0.0, 10972)])
def test_more_than_the_most_costly_difference_costs_no_more(channels, truncation, most):
    assert most_costly(channels, truncation) == most


@settings(max_examples=10, deadline=None)
@given(
    n=st.integers(2, 5),
    width=st.sampled_from([31, 70, 140]),
    least=st.integers(-2, 1),
    fineness=st.integers(1, 3),
    seed=st.integers(0, 99),
)
def test_what_no_view_sees_is_not_compared_and_not_missed(n, width, least, fineness, seed):
    view, rng = seed % n, np.random.default_rng(seed)
    scene = random_scene(n, 3, width, least, least + 4, seed)
    matcher = Matcher.of(scene, Matching(views=0, fineness=fineness, window=1)).with_reference(view)
    space, features = matcher.space, matcher.phases()
    # some columns end near, others far: runs of pixels that see a point, and of those that do not
    ends = np.repeat(rng.uniform(0, space.planes - 1, (n, 3, 1 + width // 40)), 40, axis=2)[..., :width]
    maps = np.clip(ends + rng.normal(0, 0.3, ends.shape), 0, space.planes - 1).astype(np.float32)
    spans = np.stack([matcher.ray_spans(view, j) for j in range(n)])
    shape, hidden = (2, 3, space.planes, width), np.float32(0.72)
    found, expected = np.empty(shape, np.float32), np.empty(shape, np.float32)
    weigh_pixels(
        features, maps, view, *matcher.pixel_criterion(features), spans, fineness, 0, np.float32(PRIOR),
        np.float32(ENDED), hidden, *found,
    )  # fmt: skip
    rho = matcher.rays(features, 0, 3)
    weigh_seen(rho, matcher.pairs, maps, view, spans, 0, fineness, hidden, *expected)
    np.testing.assert_allclose(found, expected, atol=1e-6)
