"""Filtered costs on scenes whose answer is known, and what of the maps is kept."""

from functools import cache

import numpy as np
import pytest
from attrs import evolve

from matbench import load_scene
from matbench.algorithm import Context, Estimate
from matbench.algorithms.guided_filter import GuidedFilter, agreed, count_agreeing, fill, match
from matbench.algorithms.sweep import Costs, Sweep
from matbench.parameters import silent_in
from matbench.scene import Range, Scene


@cache
def box() -> Scene:
    """The middle rows of the box."""
    scene = load_scene("synthetic/box")
    rows = slice(60, 90)
    truth = {view: known[rows] for view, known in scene.truth.items()}
    regions = {name: mask[rows] for name, mask in scene.regions.items()}
    return evolve(scene, views=scene.views[:, rows], truth=truth, regions=regions, visible={})


@cache
def solved(check: bool, similarity: str = "published", threads: int = 1) -> Estimate:
    return GuidedFilter(check=check, similarity=similarity).solve(box(), Context(threads=threads))


def wrong(estimate: Estimate, region: str) -> float:
    scene = box()
    error = np.abs(estimate.disparity[scene.ref] - scene.truth[scene.ref]) * scene.pair_steps
    return float((error > 1)[scene.regions[region]].mean())


@pytest.mark.parametrize("similarity", ["published", "shared"])
def test_a_box_before_a_wall(similarity: str) -> None:
    checked, plain = solved(True, similarity), solved(False, similarity)
    assert wrong(checked, "nonocc") < 0.02
    assert wrong(checked, "all") < wrong(plain, "all") + 0.005
    assert np.isfinite(checked.disparity[box().ref]).all()


def test_all_views_have_maps_and_a_surface() -> None:
    scene, estimate = box(), solved(True)
    assert set(estimate.disparity) == set(range(scene.n))
    for view, truth in scene.truth.items():
        assert (np.abs(estimate.disparity[view] - truth) * scene.pair_steps <= 1).mean() > 0.95
    assert estimate.volume is not None
    assert set(np.unique(estimate.volume.values)) == {0, 1}
    assert 0 < estimate.work["pixels_filled"] < scene.views[..., 0].size
    assert GuidedFilter().solve(scene, Context(volume=False)).volume is None


def test_threads_change_nothing() -> None:
    once, twice = solved(True), solved(True, threads=2)
    for view, disparity in once.disparity.items():
        np.testing.assert_array_equal(disparity, twice.disparity[view])
    assert once.work == twice.work


def test_half_of_the_views_that_hold_a_point_must_agree() -> None:
    scene = Scene("flat", np.zeros((4, 1, 6, 3), np.uint8), tuple("0123"), 0, Range(0, 2), {}, 1)
    sweep = Sweep.of(scene, Costs())
    maps = {view: np.full((1, 6), 1, np.float32) for view in range(4)}
    np.testing.assert_array_equal(
        agreed(sweep, maps), [[False, True, True, True, True, True]]
    )  # nothing holds the first
    maps[3][:] = 2
    np.testing.assert_array_equal(agreed(sweep, maps), [[False, True, True, True, True, True]])
    maps[2][:] = 2
    np.testing.assert_array_equal(agreed(sweep, maps), [[False, True, True, False, False, False]])


def test_holes_take_the_farther_side_of_their_colour() -> None:
    planes = np.array([[5, 5, 9, 1, 1, 1]] * 3, np.float32)
    kept = planes != 9
    image = np.zeros((3, 6, 3), np.uint8)
    np.testing.assert_array_equal(fill(planes, kept, image, 1)[:, 2], 1)
    np.testing.assert_array_equal(fill(planes, kept, image, 1)[kept], planes[kept])
    image[:, :3] = 200  # like the near side
    np.testing.assert_array_equal(fill(planes, kept, image, 1)[:, 2], 5)
    nothing = np.zeros_like(kept)
    np.testing.assert_array_equal(fill(planes, nothing, image, 1), planes)


def test_what_is_not_read_is_said() -> None:
    assert not silent_in(GuidedFilter())
    assert set(silent_in(GuidedFilter(similarity="shared"))) == {"slopes", "selection"}
    assert set(silent_in(GuidedFilter(views=2))) == {"selection"}


def test_costs_of_a_plane_are_those_of_the_equation() -> None:
    rng = np.random.default_rng(4)
    colours = rng.integers(0, 60, (2, 3, 4, 7)).astype(np.float32)
    slopes = rng.normal(0, 3, (2, 4, 7)).astype(np.float32)
    found = np.empty((4, 7), np.float32)
    match(*colours, *slopes, np.float32(0.75), found)
    apart = np.abs(colours[0] - colours[1]).astype(float).mean(axis=0)
    steep = np.abs(slopes[0] - slopes[1]).astype(float)
    np.testing.assert_allclose(found, 0.25 * np.minimum(apart, 7) + 0.75 * np.minimum(steep, 2), rtol=1e-6)
    assert (apart > 7).any()
    assert (steep > 2).any()
    assert (steep < 2).any()


def test_planes_that_are_none_agree_with_nothing() -> None:
    own, other = np.array([[0, 1, 1, -1, 2]]), np.array([[1, 0, 1, -1, 2]])
    held, same = np.zeros((2, 1, 5), np.int32)
    shifts = np.array([[0, 5, 0], [2, 5, -1]])
    count_agreeing(own, other, shifts, held, same)
    assert held.tolist() == [[1, 0, 1, 0, 0]]
    assert same.tolist() == [[0, 0, 0, 0, 0]]
    count_agreeing(own, np.array([[0, 1, 0, 0, 0]]), shifts, held, same)
    assert held.tolist() == [[2, 0, 2, 0, 0]]
    assert same.tolist() == [[1, 0, 1, 0, 0]]
