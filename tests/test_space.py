"""The geometry of disparity space (docs/concepts/disparity-space.md), against point-by-point definitions."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.scene import Range
from matbench.space import DisparitySpace, Volume, visibility

spaces = st.builds(
    lambda views, width, first, planes, fineness: DisparitySpace(views, 2, width, first, first + planes, fineness),
    st.integers(2, 4),
    st.integers(1, 5),
    st.integers(-4, 4),
    st.integers(0, 4),
    st.integers(1, 3),
)


@given(spaces)
def test_every_sample_of_every_view_meets_exactly_one_point_of_each_plane(space: DisparitySpace) -> None:
    for plane in range(space.planes):
        for view in range(space.views):
            run = space.frustum(view, plane)
            assert run.start >= 0
            assert run.stop <= space.columns
            k = space.first + plane
            for u in range(space.samples):
                x = run.start + u + space.origin  # column in image 0, samples
                assert u == x - view * k  # equation 1 with i = 0


@given(spaces)
def test_no_column_is_outside_all_frustums_of_all_planes(space: DisparitySpace) -> None:
    seen = np.zeros(space.columns, bool)
    for plane in (0, space.planes - 1):
        for view in range(space.views):
            seen[space.frustum(view, plane)] = True
    assert seen[0]
    assert seen[-1]


@settings(max_examples=40, deadline=None)
@given(spaces, st.integers(0, 2**32 - 1))
def test_visibility_is_the_product_along_each_ray(space: DisparitySpace, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mu = rng.random(space.shape, np.float32)
    mu[rng.random(space.shape) < 0.1] = 1
    for view in range(space.views):
        seen = visibility(Volume(space, mu, tuple(range(space.views))), view)
        expected = np.zeros(space.shape)
        for plane in range(space.planes):
            for u in range(space.samples):
                nearer = range(plane + 1, space.planes)
                through = [1 - mu[:, p, space.start(view, p) + u].astype(float) for p in nearer]
                expected[:, plane, space.start(view, plane) + u] = np.prod(through, axis=0) if through else 1
        np.testing.assert_allclose(seen, expected, atol=1e-6)


def test_planes_cover_the_range_and_no_more() -> None:
    assert DisparitySpace.covering(Range(0, 4.75), 5, 1, 9, 4).disparities.tolist() == [k / 4 for k in range(20)]
    space = DisparitySpace.covering(Range(-1.1, 0.9), 3, 1, 9)
    assert (space.first, space.last) == (-2, 1)
    assert DisparitySpace.covering(Range(59 / 4, 59 / 4), 3, 1, 9, 4).planes == 1


@given(spaces)
def test_values_in_a_view_are_those_on_its_whole_pixels(space: DisparitySpace) -> None:
    columns = np.broadcast_to(np.arange(space.columns), space.shape).astype(np.int32)
    for view in range(space.views):
        picked = space.in_view(columns, view)
        for plane in range(space.planes):
            start = space.start(view, plane)
            expected = [start + x * space.fineness for x in range(space.width)]
            assert picked[0, plane].tolist() == expected
