"""Regions: against published masks, exact visibility and small cases by hand."""

import numpy as np
import pytest
from real import Real

from matbench.datasets.middlebury import MIDDLEBURY_2001, MIDDLEBURY_2003
from matbench.datasets.synthetic import SYNTHETIC, WORLDS
from matbench.files.images import read_levels
from matbench.regions import (
    VIEW_REGIONS,
    counts,
    is_sparse,
    near_jumps,
    points_seen,
    regions,
    seen_by,
    textureless,
    view_regions,
)
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
def test_overlap_with_published_masks(real: Real, dataset, scene: str, occluded: float, jumps: float) -> None:
    """Intersection over union, for the occluded part inside `all` and for `disc`."""
    root = real(f"middlebury/eval_v2/{scene}", f"middlebury{dataset.year}/{scene}")
    folder = root / "middlebury/eval_v2" / scene
    nonocc, everything, disc = (read_levels(folder / f"{name}.png") == 255 for name in ("nonocc", "all", "disc"))
    found = dataset.load(scene, {}, root).regions
    assert _overlap(found["occ"] & everything, everything & ~nonocc) > occluded
    assert _overlap(found["disc"] & everything, disc) > jumps
    if scene != "venus":  # there a border of 10 px was left out
        np.testing.assert_array_equal(found["all"], everything)


def test_regions_nest(real: Real) -> None:
    for scene in (
        MIDDLEBURY_2003.load("teddy", {}, real("middlebury2003/teddy")),
        SYNTHETIC.load("weak", {"size": "120x90"}, None),
    ):
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
    np.testing.assert_array_equal(points_seen(truth, 1)[0], np.array([0, 0, 0, 1, 1, 1, 1, 1, 0], bool))
    # to the left everything moves to larger columns: 1 2 3 4 | 8 9 | 7 8
    np.testing.assert_array_equal(points_seen(truth, -1)[0], np.array([1, 1, 1, 1, 1, 0, 1, 0, 0], bool))


def test_a_slanted_surface_does_not_hide_itself() -> None:
    slope = (np.arange(40) * 0.5 + 2).astype(np.float32)[None]
    assert points_seen(slope, 1)[0, 5:].all()
    assert points_seen(slope / 4, 4)[0, 5:].all()


def test_steps_scale_with_the_pair() -> None:
    truth = np.random.default_rng(0).uniform(0, 5, (6, 50)).astype(np.float32)
    np.testing.assert_array_equal(points_seen(truth, 2), points_seen(truth * 2, 1))


def test_both_directions_are_mirror_images() -> None:
    truth = np.random.default_rng(0).uniform(0, 5, (6, 50)).astype(np.float32)  # no ties in rounding
    np.testing.assert_array_equal(points_seen(truth, 1), points_seen(truth[:, ::-1], -1)[:, ::-1])


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
    warped = ~points_seen(scene.truth[scene.ref], steps)
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
def test_truth_explains_the_real_views(real: Real, dataset, scene: str) -> None:
    loaded = dataset.load(scene, {}, real(f"middlebury{dataset.year}/{scene}"))
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


def _which(masks) -> list[str]:
    """The one region of every pixel of a row; a blank where it is in none."""
    assert list(masks) == list(VIEW_REGIONS)
    assert (np.sum(list(masks.values()), axis=0) <= 1).all()
    letters = np.full(masks["seen_once"].shape, " ")
    for letter, mask in zip("ahfo", masks.values(), strict=True):
        letters[mask] = letter
    return ["".join(row) for row in letters]


def test_views_that_see_a_point_are_counted() -> None:
    truth = np.array([[1, 1, 1, 1, 4, 4, 1, 1, NAN, 1, 1, 1]], np.float32)
    # in view 2 the two at disparity 4 cover columns 0 and 1: the wall's columns 1 and 2; column 0 leaves the frame
    # in view 0 they cover 8 and 9: the wall's columns 7 and 8; column 11 leaves the frame
    assert _which(view_regions(truth, 1, 3)) == ["fhhaaaah aaf"]
    assert _which(view_regions(truth, 0, 2)) == ["oooaaaaa aaa"]
    assert _which(view_regions(truth, 1, 2)) == ["aaaaaaao aao"]
    # view 3 (two steps right): the wall moves to x - 2, the near ones from 4 and 5 to -4 and -3, out of the frame
    assert _which(view_regions(truth, 1, 4)) == ["fhhaffah aaf"]


def test_hidden_here_and_out_of_frame_there_is_half_occluded_or_seen_once() -> None:
    seen = np.zeros((4, 1, 4), bool)
    seen[1] = True
    seen[2, 0] = [True, False, False, True]
    truth = np.array([[0, 0, 9, 9]], np.float32)  # the last two leave the frame on either side
    # seen in 2, hidden in 0 and 3; nowhere but in 1; seen nowhere, out of the frame; seen in 2, out of frames
    assert _which(view_regions(truth, 1, 4, seen)) == ["hoof"]


@pytest.mark.parametrize("name", sorted(WORLDS))
def test_derived_regions_over_views_agree_with_exact_ones(name: str) -> None:
    """The share of pixels in the same region, and the overlap of the hard ones, from one view's truth alone."""
    scene = SYNTHETIC.load(name, {}, None)
    truth = scene.truth[scene.ref]
    exact, derived = (view_regions(truth, scene.ref, scene.n, seen) for seen in (scene.visible[scene.ref], None))
    assert all("a" in row and " " not in row for row in _which(exact))
    agreement = sum((exact[region] & derived[region]).mean() for region in exact)
    is_thin = name == "thin"  # wires narrower than a pixel: where they begin cannot be told from pixels
    assert agreement > (0.96 if is_thin else 0.985)
    assert _overlap(exact["half_occluded"], derived["half_occluded"]) > (0.85 if is_thin else 0.88)
    assert _overlap(exact["out_of_frame"], derived["out_of_frame"]) > 0.99


def test_regions_over_views_follow_a_choice_of_views_and_the_others_do_not() -> None:
    scene = SYNTHETIC.load("steps", {"size": "120x90"}, None)
    three = scene.choose([0, 2, 4])
    near = scene.choose([1, 2, 3])
    for name in scene.regions:
        np.testing.assert_array_equal(three.scored_regions[name], scene.regions[name])
    shares = [s.scored_regions["half_occluded"].mean() for s in (scene, three, near)]
    assert shares[0] > 1.5 * shares[2] > 0
    assert shares[1] == pytest.approx(shares[0], abs=0.01)
    np.testing.assert_array_equal(
        sum(near.scored_regions[name].astype(int) for name in VIEW_REGIONS), np.ones((90, 120), int)
    )
    two = scene.choose([2, 4]).scored_regions  # the field's pair
    np.testing.assert_array_equal(two["seen_in_all"], scene.regions["nonocc"])
    np.testing.assert_array_equal(two["seen_once"], scene.regions["occ"])
    assert not two["half_occluded"].any()


@pytest.mark.parametrize("exact", [True, False])
def test_pixels_by_how_many_views_see_them(exact: bool) -> None:
    scene = SYNTHETIC.load("steps", {"size": "120x90"}, None)
    truth, seen = scene.truth[scene.ref], scene.visible[scene.ref] if exact else None
    masks, over_views = (of(truth, scene.ref, scene.n, seen) for of in (seen_by, view_regions))
    assert list(masks) == [f"seen_{number}" for number in range(1, scene.n + 1)]
    np.testing.assert_array_equal(sum(mask.astype(int) for mask in masks.values()), np.isfinite(truth))
    np.testing.assert_array_equal(masks["seen_1"], over_views["seen_once"])
    np.testing.assert_array_equal(masks[f"seen_{scene.n}"], over_views["seen_in_all"])
    if seen is not None:
        others = [view for view in range(scene.n) if view != scene.ref]
        for number, mask in enumerate(masks.values(), 1):
            assert (1 + seen[others].sum(axis=0)[mask] == number).all()


def test_real_scenes_have_regions_over_views(real: Real) -> None:
    scene = MIDDLEBURY_2003.load("teddy", {}, real("middlebury2003/teddy"))
    masks = scene.scored_regions
    known = np.isfinite(scene.truth[scene.ref])
    np.testing.assert_array_equal(np.any([masks[name] for name in VIEW_REGIONS], axis=0), known)
    assert masks["half_occluded"].mean() > 0.05
    assert masks["out_of_frame"].mean() > 0.1, "eight views reach far to the right"
    # what the pair sees is seen in two views at least, and what all see the pair sees
    assert not (masks["seen_once"] & masks["nonocc"]).any()
    assert not (masks["seen_in_all"] & masks["occ"]).any()


@pytest.mark.parametrize(
    ("pixels", "known", "does"),
    [
        (0, 43200, False),
        (1, 43200, False),
        (215, 43200, False),  # 0.5 % are 216
        (216, 43200, True),
        (34230, 43200, True),
        (60, 6912, False),  # more than 0.5 %, but too few
        (99, 6912, False),
        (100, 6912, True),
        (50, 50, True),  # the whole scene
        (0, 0, False),
    ],
)
def test_small_regions_do_not_count(pixels: int, known: int, does: bool) -> None:
    assert counts(pixels, known) is does


def test_of_sparse_truth_only_what_is_given_is_known() -> None:
    image = np.random.default_rng(0).integers(0, 256, (20, 30, 3), np.uint8)
    truth = np.where(np.random.default_rng(1).random((20, 30)) < 0.2, np.float32(3), np.float32(np.nan))
    assert is_sparse(truth)
    assert not is_sparse(np.where(np.arange(30) < 5, np.nan, truth * 0 + 3).astype(np.float32)[:, :0])
    assert not is_sparse(np.full((20, 30), 3, np.float32))
    known = np.isfinite(truth)
    assert list(regions(image, truth, 1, sparse=True)) == ["all"]
    seen = np.arange(30) * np.ones((20, 1)) > 10
    found = regions(image, truth, 1, seen, sparse=True)
    assert list(found) == ["all", "nonocc", "occ", "textureless"]
    np.testing.assert_array_equal(found["occ"], known & ~seen)


def test_view_regions_follow_the_positions_of_the_views() -> None:
    truth = np.full((2, 20), 2, np.float32)
    even = view_regions(truth, 0, 4)
    apart = view_regions(truth, 0, 3, None, (0, 1, 3))
    np.testing.assert_array_equal(apart["seen_in_all"], even["seen_in_all"])
    assert apart["seen_in_all"].sum() == 2 * (20 - 6)
    assert apart["seen_once"].sum() == 2 * 2
