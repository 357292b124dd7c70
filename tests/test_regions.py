"""Regions: against published masks, exact visibility and small cases by hand."""

from pathlib import Path

import numpy as np
import pytest

from matbench.datasets.images import read_grey
from matbench.datasets.middlebury import MIDDLEBURY_2001, MIDDLEBURY_2003
from matbench.datasets.synthetic import SYNTHETIC
from matbench.regions import near_jumps, regions, seen_from, textureless
from matbench.scene import Scene

NAN = np.nan


def _overlap(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / (a | b).sum())


@pytest.mark.parametrize(
    ("dataset", "scene", "occluded", "jumps"),
    [
        (MIDDLEBURY_2001, "tsukuba", 0.99, 0.99),
        (MIDDLEBURY_2001, "venus", 0.915, 0.96),
        (MIDDLEBURY_2003, "teddy", 0.95, 0.93),
    ],
)
def test_overlap_with_published_masks(data_root: Path, dataset, scene: str, occluded: float, jumps: float) -> None:
    """Intersection over union, for the occluded part inside `all` and for `disc`."""
    folder = data_root / "middlebury" / "eval_v2" / scene
    nonocc, everything, disc = (read_grey(folder / f"{name}.png") == 255 for name in ("nonocc", "all", "disc"))
    found = dataset.load(scene, {}, data_root).regions
    assert _overlap(found["occ"] & everything, everything & ~nonocc) > occluded
    assert _overlap(found["disc"] & everything, disc) > jumps
    if scene != "venus":  # there a border of 10 px was left out
        np.testing.assert_array_equal(found["all"], everything)


def test_regions_nest(data_root: Path) -> None:
    for scene in (MIDDLEBURY_2003.load("teddy", {}, data_root), SYNTHETIC.load("weak", {"size": "120x90"}, None)):
        masks = scene.regions
        assert list(masks) == ["all", "nonocc", "occ", "disc", "textureless"]
        np.testing.assert_array_equal(masks["all"], np.isfinite(scene.truth[scene.ref]))
        np.testing.assert_array_equal(masks["all"], masks["nonocc"] ^ masks["occ"])
        assert not (masks["disc"] & ~masks["nonocc"]).any()
        assert not (masks["textureless"] & ~masks["nonocc"]).any()
        assert all(mask.any() for mask in masks.values())


def test_nearer_surface_hides_and_the_frame_ends() -> None:
    truth = np.array([[1, 1, 1, 1, 4, 4, 1, 1, NAN]], np.float32)
    # carried to -1 0 1 2 | 0 1 | 5 6
    np.testing.assert_array_equal(seen_from(truth, 1)[0], np.array([0, 0, 0, 1, 1, 1, 1, 1, 0], bool))
    # to the left everything moves to larger columns: 1 2 3 4 | 8 9 | 7 8
    np.testing.assert_array_equal(seen_from(truth, -1)[0], np.array([1, 1, 1, 1, 1, 0, 1, 0, 0], bool))


def test_a_slanted_surface_does_not_hide_itself() -> None:
    slope = (np.arange(40) * 0.5 + 2).astype(np.float32)[None]
    assert seen_from(slope, 1)[0, 5:].all()
    assert seen_from(slope / 4, 4)[0, 5:].all()


def test_steps_scale_with_the_pair() -> None:
    truth = np.random.default_rng(0).uniform(0, 5, (6, 50)).astype(np.float32)
    np.testing.assert_array_equal(seen_from(truth, 2), seen_from(truth * 2, 1))


def test_both_directions_are_mirror_images() -> None:
    truth = np.random.default_rng(0).uniform(0, 5, (6, 50)).astype(np.float32)  # no ties in rounding
    np.testing.assert_array_equal(seen_from(truth, 1), seen_from(truth[:, ::-1], -1)[:, ::-1])


def test_jump_marks_both_sides() -> None:
    disparity = np.zeros((1, 40), np.float32)
    disparity[0, 20:] = 2
    none = np.zeros((1, 40), bool)
    assert np.flatnonzero(near_jumps(disparity, none)[0]).tolist() == list(range(15, 25))
    assert not near_jumps(disparity * np.float32(0.99), none).any()
    assert near_jumps(disparity.T, none.T).any()


def test_jump_across_a_hole() -> None:
    disparity = np.zeros((1, 40), np.float32)
    disparity[0, 10:13] = NAN
    none = np.zeros((1, 40), bool)
    assert not near_jumps(disparity, none).any()
    disparity[0, 13:] = 5
    assert np.flatnonzero(near_jumps(disparity, none)[0]).tolist() == list(range(5, 18))


def test_occlusions_are_near_jumps() -> None:
    occluded = np.zeros((20, 20), bool)
    occluded[10, 10] = True
    assert near_jumps(np.zeros((20, 20), np.float32), occluded).sum() == 81


def test_textureless_is_below_four_grey_levels() -> None:
    image = np.zeros((9, 30, 3), np.uint8)
    image[:, 15:] = 100
    low = textureless(image)
    assert np.flatnonzero(~low[4]).tolist() == [13, 14, 15, 16]
    stripes = np.zeros((9, 30, 3), np.uint8)
    stripes[:, ::2] = 3
    assert textureless(stripes).all()
    assert not textureless(stripes // 3 * 4).any()


def test_a_vertical_gradient_is_no_texture() -> None:
    image = np.zeros((30, 9, 3), np.uint8)
    image[::2] = 200
    assert textureless(image).all()


@pytest.mark.parametrize("name", ["box", "curved", "weak"])
def test_warping_agrees_with_exact_visibility(name: str) -> None:
    scene = SYNTHETIC.load(name, {}, None)
    steps = int(scene.pair_steps)
    exact = ~scene.visible[scene.ref][scene.ref + steps]
    warped = ~seen_from(scene.truth[scene.ref], steps)
    assert _overlap(exact, warped) > 0.85
    assert (exact ^ warped).mean() < 0.01


def _mean_difference(scene: Scene, view: int, shift: float, mask: np.ndarray) -> float:
    """Mean grey difference of the reference view and a view warped by the truth plus a shift (px per step)."""
    rows, columns = np.nonzero(mask)
    place = columns - (view - scene.ref) * (scene.truth[scene.ref][mask] + shift)
    inside = (place >= 0) & (place <= scene.width - 1.001)
    rows, columns, place = rows[inside], columns[inside], place[inside]
    left = np.floor(place).astype(int)
    weight = (place - left)[:, None]
    other = scene.views[view].astype(float)
    warped = other[rows, left] * (1 - weight) + other[rows, left + 1] * weight
    return float(np.abs(warped - scene.views[scene.ref][rows, columns]).mean())


@pytest.mark.parametrize("name", ["box", "curved", "weak"])
def test_truth_explains_the_synthetic_views(name: str) -> None:
    scene = SYNTHETIC.load(name, {}, None)
    for view in range(scene.n):
        if view != scene.ref:
            seen = scene.visible[scene.ref][view]
            right, *wrong = (_mean_difference(scene, view, shift, seen) for shift in (0, -1, 1))
            assert right < (0.8 if name == "weak" else 0.5) * min(wrong)


@pytest.mark.parametrize(
    ("dataset", "scene"), [(MIDDLEBURY_2001, "tsukuba"), (MIDDLEBURY_2001, "venus"), (MIDDLEBURY_2003, "teddy")]
)
def test_truth_explains_the_real_views(data_root: Path, dataset, scene: str) -> None:
    loaded = dataset.load(scene, {}, data_root)
    for view in range(loaded.n):
        if view != loaded.ref:
            # on the side of the partner nothing is hidden that the partner sees
            mask = loaded.regions["nonocc"]
            right, *wrong = (_mean_difference(loaded, view, shift, mask) for shift in (0, -1, 1))
            assert right < 0.9 * min(wrong), loaded.labels[view]


def test_known_visibility_is_used() -> None:
    truth = np.ones((4, 30), np.float32)
    seen = np.random.default_rng(0).random((4, 30)) < 0.5
    masks = regions(np.zeros((4, 30, 3), np.uint8), truth, 1, seen)
    np.testing.assert_array_equal(masks["nonocc"], seen)
