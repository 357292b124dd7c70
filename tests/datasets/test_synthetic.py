"""Computed scenes: exact geometry and visibility, the same every time."""

from pathlib import Path

import numpy as np
import pytest

from matbench.datasets.synthetic import SYNTHETIC, WORLDS, materiality
from matbench.datasets.synthetic.cameras import Strengths, exposed, heights
from matbench.datasets.synthetic.rendering import Rig, mirrored
from matbench.datasets.synthetic.surfaces import EVERYWHERE, LIGHT, Column, Disc, Paint, Rectangle, Sphere
from matbench.datasets.synthetic.textures import pattern
from matbench.errors import UserError
from matbench.regions import textureless
from matbench.scene import Scene

PINNED = [-0.699616, -0.784289, -0.679456, 0.839368, -0.569503, -0.892212]
DIGESTS = {"box": "45b2409079e539e4", "curved": "fc74608f94a75284", "weak": "3b472ae62c13c112"}
PAINT = Paint((100, 100, 100), 20, 1.0)
SMALL = {"size": "120x90"}


def _wall(z: float, paint: Paint = PAINT) -> Rectangle:
    return Rectangle((-90.0, -90.0, z), (180.0, 0.0, 0.0), (0.0, 180.0, 0.0), paint)


def _rig(*surfaces, offset: float = 0.0) -> Rig:
    return Rig(surfaces, 3, 61, 41, focal=60.0, baseline=0.1, offset=offset)


@pytest.fixture(scope="module", params=sorted(WORLDS))
def scene(request: pytest.FixtureRequest) -> Scene:
    return SYNTHETIC.load(request.param, SMALL, None)


def test_a_wall_has_the_disparity_of_its_depth() -> None:
    assert _rig(_wall(3.0)).truth(0) == pytest.approx(60 * 0.1 / 3)
    assert _rig(_wall(3.0), offset=2.5).truth(2) == pytest.approx(60 * 0.1 / 3 - 2.5)


def test_a_slanted_plane_has_linear_disparity() -> None:
    truth = _rig(Rectangle((-5, -5, 2.0), (10, 0, 4.0), (0, 10, 0), PAINT)).truth(1)
    assert np.isfinite(truth).all()
    assert np.abs(np.diff(truth, axis=1) - (truth[0, 1] - truth[0, 0])).max() < 1e-12
    assert np.abs(np.diff(truth, axis=0)).max() < 1e-12
    # on the middle ray X = 0: depth 2 + 4 / 2
    assert truth[20, 30] == pytest.approx(60 * 0.1 / 4)


def test_round_surfaces_are_where_they_should_be() -> None:
    ball = _rig(_wall(9.0), Sphere((0.0, 0.0, 3.0), 1.0, PAINT))
    column = _rig(_wall(9.0), Column(0.0, 3.0, 1.0, PAINT))
    for rig in (ball, column):
        assert rig.truth(1)[20, 30] == pytest.approx(60 * 0.1 / 2), "its front is at depth 2"
    # tangents have a slope of 1 / sqrt(8)
    edge = 60 / 8**0.5
    assert (ball.cast(1, np.arange(61.0)[None], np.array([[20.0]]))[1][0] == 1).sum() == 2 * int(edge) + 1
    assert (column.truth(1)[0] == column.truth(1)[20]).all()


def test_visibility_of_a_screen_before_a_wall() -> None:
    screen = Rectangle((-0.21, -9, 1.5), (0.42, 0, 0), (0, 18, 0), PAINT)
    rig = _rig(_wall(3.0), screen)
    truth, seen = rig.truth(1), rig.visible(1)
    assert sorted(set(truth[20].round(9))) == [2, 4]
    on_screen = np.flatnonzero(truth[20] > 3)
    assert on_screen.tolist() == list(range(22, 39))  # |x - 30| <= 60 * 0.21 / 1.5 = 8.4
    # the screen moves 4 and the wall 2 px to the left in view 2: the two columns on its left are hidden
    assert np.flatnonzero(~seen[2][20]).tolist() == [0, 1, 20, 21]
    assert np.flatnonzero(~seen[0][20]).tolist() == [39, 40, 59, 60]
    assert seen[1].all()


def test_what_is_seen_in_another_view_has_the_same_disparity_there(scene: Scene) -> None:
    """Consistency by the truth maps alone, away from the jumps that pixels cannot resolve."""
    for view in range(scene.n):
        truth, seen = scene.truth[view], scene.visible[view]
        for other in range(scene.n):
            place = np.arange(scene.width)[None, :] - (other - view) * truth
            column = np.clip(np.floor(place + 0.5), 0, scene.width - 1).astype(int)
            inside = (place >= -0.5) & (place < scene.width - 0.5)
            near = [np.clip(column + k, 0, scene.width - 1) for k in (-1, 0, 1)]
            there = np.stack([np.take_along_axis(scene.truth[other], c, axis=1) for c in near])
            assert not (seen[other] & ~inside).any()
            assert (np.abs(there - truth).min(axis=0) < 0.2)[seen[other]].mean() > 0.999
            hidden = inside & ~seen[other]
            if hidden.any():
                # what hides may be narrower than a pixel in that scene, and fall between pixels
                share = 0.995 if "thin" in scene.name else 0.999
                assert (there.max(axis=0) > truth)[hidden].mean() > share


def test_visibility_is_mutual(scene: Scene) -> None:
    """About as many points of i are seen in j as of j in i, and every view sees itself."""
    for view in range(scene.n):
        assert scene.visible[view][view].all()
    a, b = scene.visible[0][4].mean(), scene.visible[4][0].mean()
    assert 0.5 < a < 1
    assert a == pytest.approx(b, abs=0.03)


def test_every_view_has_exact_truth_within_the_range(scene: Scene) -> None:
    assert sorted(scene.truth) == sorted(scene.visible) == list(range(5))
    for truth in scene.truth.values():
        assert np.isfinite(truth).all()
        assert scene.disparities.least < truth.min() - 0.2
        assert truth.max() + 0.2 < scene.disparities.largest
    assert (scene.labels, scene.ref, scene.pair_steps) == (("0", "1", "2", "3", "4"), 2, 2)
    np.testing.assert_array_equal(scene.regions["nonocc"], scene.visible[2][4])


def test_default_scenes_have_what_their_names_promise() -> None:
    scenes = {name: SYNTHETIC.load(name, {}, None) for name in WORLDS}
    shares = {name: s.regions["textureless"].mean() for name, s in scenes.items()}
    assert shares["weak"] > 0.6
    assert max(shares["box"], shares["curved"]) < 0.15
    assert scenes["curved"].truth[2].min() < 0 < scenes["curved"].truth[2].max()
    assert all(s.views.shape == (5, 180, 240, 3) for s in scenes.values())
    assert all(s.regions["occ"].mean() > 0.02 for s in scenes.values())
    assert {name: scenes[name].digest[:16] for name in DIGESTS} == DIGESTS
    assert not any(_faces_the_cameras(scenes[name]).any() for name in ("slanted", "spheres"))
    assert _faces_the_cameras(scenes["layers"]).mean() > 0.9
    assert scenes["layers"].truth[2].max() > 4 * scenes["layers"].truth[2].min()
    assert np.diff(scenes["steps"].truth[2], axis=1).max() * 2 > 20, "px of the pair"
    widths = _widths(scenes["thin"].truth[2] > 3)
    assert widths.min() == 1
    assert np.median(widths) <= 3
    fence = scenes["fence"].truth[2][60] > 3
    starts = np.flatnonzero(np.diff(fence.astype(int)) == 1)
    assert len(starts) == 23
    assert set(np.diff(starts)) == {7, 8}
    upright = _widths((scenes["fence"].truth[2] > 3)[:, starts[10] + 1][None])
    assert len(upright) == 7, "one picket and, below it, the rails, across which the column runs"
    assert upright[0] >= 76
    assert set(upright[1:]) <= {3, 4}


def _faces_the_cameras(scene: Scene) -> np.ndarray:
    """Where disparity is the same all around."""
    truth = scene.truth[scene.ref]
    return np.ptp(np.lib.stride_tricks.sliding_window_view(truth, (3, 3)), axis=(2, 3)) == 0


def _widths(mask: np.ndarray) -> np.ndarray:
    """Lengths of the runs of True in the rows."""
    edges = np.diff(np.pad(mask.astype(int), ((0, 0), (1, 1))), axis=1)
    return np.nonzero(edges == -1)[1] - np.nonzero(edges == 1)[1]


@pytest.mark.parametrize("name", sorted(WORLDS))
def test_windows_leave_nothing_out(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The slow twin tries every ray on every surface."""
    rig = Rig(WORLDS[name].build(), 5, 60, 45, 60, 1 / 40, WORLDS[name].offset / 4)
    rows = np.arange(45.0)[:, None]
    places = np.random.default_rng(0).uniform(-3, 62, (45, 60))
    quick = [rig.cast(view, columns, rows) for view in (0, 3) for columns in (np.arange(60.0)[None], places)]
    for kind in (Rectangle, Disc, Sphere, Column):
        monkeypatch.setattr(kind, "window", lambda self, eye: EVERYWHERE)
    slow = [rig.cast(view, columns, rows) for view in (0, 3) for columns in (np.arange(60.0)[None], places)]
    for (depth, index), (expected, which) in zip(quick, slow, strict=True):
        np.testing.assert_array_equal(depth, expected)
        np.testing.assert_array_equal(index, which)


def test_highlights_move_with_the_camera_and_nothing_else_does() -> None:
    """On a wall without texture the only thing to be seen is the highlight: it stays where it is in every view."""
    wall = Rectangle((-8, -8, 7.6), (16, 0, -4.7), (0, 16, -4.6), Paint((60, 60, 60), 0, 1.0))
    dull, shiny = (Rig([wall], 3, 61, 41, 60, 0.1, highlight=grey) for grey in (0, 100))
    marks = pattern(0)
    assert np.ptp(dull.picture(0, marks)) < 1e-3
    peaks = [np.unravel_index(shiny.picture(view, marks)[..., 0].argmax(), (41, 61)) for view in range(3)]
    assert len(set(peaks)) == 1, "the light is infinitely far"
    assert shiny.picture(1, marks).max() == pytest.approx(dull.picture(1, marks).max() + 100, abs=2)
    assert wall.depth(0.0, np.zeros((1, 1)), np.zeros((1, 1))).item() == pytest.approx(2.95)


def test_a_mirror_towards_the_light_is_as_bright_as_it_can_be() -> None:
    here = (np.zeros(1), np.zeros(1), np.ones(1))  # a normal (0, 0, 1), the eye along it
    assert mirrored(LIGHT, tuple(np.array([c]) for c in LIGHT)) == pytest.approx(1)
    half = np.array(LIGHT) / 2 + (0, 0, 0.5)
    assert mirrored((0, 0, 1), here) == pytest.approx((half[2] / np.linalg.norm(half)) ** 32)


@pytest.mark.parametrize(
    ("option", "level"), [("gain", "0.3"), ("bias", "20"), ("vignetting", "0.5"), ("blur", "2"), ("highlight", "90")]
)
def test_cameras_change_pictures_only(option: str, level: str) -> None:
    clean, changed = (SYNTHETIC.load("box", SMALL | {"noise": "0"} | more, None) for more in ({}, {option: level}))
    assert changed.digest != clean.digest
    for view in range(5):
        np.testing.assert_array_equal(changed.truth[view], clean.truth[view])
        np.testing.assert_array_equal(changed.visible[view], clean.visible[view])


@pytest.mark.parametrize("name", ["box", "weak", "highlight"])
@pytest.mark.parametrize(
    "disturbance",
    [
        {"noise": "4"},
        {"noise": "8"},
        {"noise": "50", "gain": "0.3", "bias": "20"},
        {"blur": "2"},
        {"vignetting": "0.5"},
        {"highlight": "90"},
    ],
)
def test_regions_are_those_of_the_undisturbed_scene(name: str, disturbance: dict[str, str]) -> None:
    """What is swept does not change what is scored."""
    nothing = {"noise": "0", "highlight": "0"}
    clean, disturbed = (SYNTHETIC.load(name, SMALL | more, None) for more in (nothing, nothing | disturbance))
    assert disturbed.digest != clean.digest
    assert clean.regions["textureless"].any()
    for region, mask in clean.scored_regions.items():
        np.testing.assert_array_equal(disturbed.scored_regions[region], mask)
    # without any disturbance they are those of the picture that methods are given
    np.testing.assert_array_equal(
        clean.regions["textureless"], clean.regions["nonocc"] & textureless(clean.views[clean.ref])
    )


def test_regions_of_a_misaligned_camera_are_where_its_picture_is() -> None:
    scene = SYNTHETIC.load("weak", SMALL | {"noise": "0", "misaligned": "6"}, None)
    expected = scene.regions["nonocc"] & textureless(scene.views[scene.ref])
    np.testing.assert_array_equal(scene.regions["textureless"], expected)


def _clean_and(**strengths: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """A grey picture, and what five cameras make of it."""
    picture = np.random.default_rng(0).uniform(60, 140, (90, 120, 3)).astype(np.float32)
    views = [exposed(picture, Strengths(noise=0, **strengths), 3, view, 5) for view in range(5)]
    return picture.astype(float), [v.astype(float) for v in views]


def test_gain_and_bias_differ_from_camera_to_camera() -> None:
    picture, views = _clean_and(gain=0.3)
    gains = [float((v * picture).sum() / (picture**2).sum()) for v in views]
    assert max(abs(g - 1) for g in gains) == pytest.approx(0.3, abs=1e-3)
    assert len({round(g, 3) for g in gains}) == 5
    picture, views = _clean_and(bias=20)
    biases = [float((v - picture).mean()) for v in views]
    assert max(map(abs, biases)) == pytest.approx(20, abs=0.02)
    assert np.corrcoef(gains, biases)[0, 1] < 0.99, "each is drawn for itself"


def test_vignetting_darkens_corners_and_blur_smooths() -> None:
    picture, views = _clean_and(vignetting=0.4)
    assert views[0][0, 0] / picture[0, 0] == pytest.approx(0.6, abs=0.01)
    assert views[4][45, 60] / picture[45, 60] == pytest.approx(1, abs=0.01)
    picture, views = _clean_and(blur=2)
    # white noise keeps 1 / (4 pi sigma^2) of its variance
    assert views[2][10:-10, 10:-10].var() / picture.var() == pytest.approx(1 / (16 * np.pi), rel=0.1)
    assert views[2].mean() == pytest.approx(picture.mean(), abs=0.2)


def test_misaligned_views_stay_exact() -> None:
    options = SMALL | {"noise": "0"}
    straight, crooked = (SYNTHETIC.load("spheres", options | more, None) for more in ({}, {"misaligned": "3"}))
    lower = heights(Strengths(misaligned=3), 0, 5)
    assert max(map(abs, lower)) == 3
    view = int(np.argmax(np.abs(lower)))
    shift = round(lower[view])
    rows = np.arange(10, 80)
    np.testing.assert_array_equal(crooked.truth[view][rows + shift], straight.truth[view][rows])
    np.testing.assert_array_equal(crooked.views[view][rows + shift], straight.views[view][rows])
    # in the reference view the rows that another camera misses are not seen there
    gone = int(np.ceil(abs(lower[view] - lower[2]) - 0.5))
    ends = crooked.visible[2][view][-gone:] if lower[view] > lower[2] else crooked.visible[2][view][:gone]
    assert not ends.any()


@pytest.mark.parametrize("fineness", [1, 2])
@pytest.mark.parametrize("name", ["box", "curved", "steps"])
def test_materialities_are_those_of_the_truth(name: str, fineness: int) -> None:
    """Along every ray of every view the first material point is the true one, within a plane."""
    scene, exact = SYNTHETIC.load(name, SMALL, None), materiality(name, SMALL, fineness)
    assert set(np.unique(exact.values)) == {0, 1}
    for view in range(5):
        rays = exact.space.in_view(exact.values, view)
        nearest = exact.space.planes - 1 - rays[:, ::-1].argmax(axis=1)
        assert rays.any(axis=1).all()
        off = exact.space.disparities[nearest] - scene.truth[view]
        # another view's ray may mark a neighbour where the surface leans
        assert (np.abs(off) * fineness <= 0.5001).mean() > 0.9
        assert (np.abs(off) * fineness <= 1.0001).mean() > 0.97
        plane = np.round(scene.truth[view].astype(float) * fineness).astype(int) - exact.space.first
        assert np.take_along_axis(rays, plane[:, None], axis=1).all()


def test_the_same_every_time_and_another_with_another_seed() -> None:
    one, again, other = (SYNTHETIC.load("box", SMALL | seed, None) for seed in ({}, {"seed": "0"}, {"seed": "1"}))
    assert one.digest == again.digest
    assert one.digest != other.digest
    np.testing.assert_array_equal(one.truth[2], other.truth[2])


def test_the_pattern_is_pinned() -> None:
    """It must be the same with every version of NumPy: scores of different machines are compared."""
    marks = pattern(0)
    assert marks.shape == (256, 256, 3)
    assert float(marks.mean()) == pytest.approx(0, abs=0.01)
    assert float(marks.std()) == pytest.approx(1, abs=0.02)
    assert marks[[0, 100], [0, 50]].ravel().tolist() == pytest.approx(PINNED, abs=1e-5)


def test_noise_has_the_deviation_asked_for() -> None:
    clean, noisy = (SYNTHETIC.load("weak", SMALL | {"noise": level}, None) for level in ("0", "4"))
    difference = noisy.views.astype(float) - clean.views
    assert difference.std() == pytest.approx(4, abs=0.15)
    assert abs(difference.mean()) < 0.1
    assert difference[0].tobytes() != difference[1].tobytes()


def test_size_scales_disparities() -> None:
    small, large = (SYNTHETIC.load("box", {"size": size}, None) for size in ("60x44", "120x88"))
    assert large.truth[2].max() == pytest.approx(2 * small.truth[2].max(), rel=0.05)
    assert large.disparities.largest == 2 * small.disparities.largest


@pytest.mark.parametrize(("n", "ref", "pair"), [(2, 1, 1), (3, 1, 1), (4, 2, 1), (5, 2, 2), (9, 4, 4)])
def test_number_of_views(n: int, ref: int, pair: int) -> None:
    scene = SYNTHETIC.load("curved", {"n": str(n), "size": "48x36"}, None)
    assert (scene.n, scene.ref, scene.pair_steps) == (n, ref, pair)
    assert scene.name == f"synthetic/curved[n={n} size=48x36]"


@pytest.mark.parametrize("ref", range(5))
def test_every_view_can_be_scored(ref: int) -> None:
    scene = SYNTHETIC.load("box", {"ref": str(ref), "size": "48x36"}, None)
    partner = ref + 2 if ref < 3 else ref - 2
    assert (scene.ref, scene.pair_steps) == (ref, 2)
    np.testing.assert_array_equal(scene.regions["nonocc"], scene.visible[ref][partner])


def test_views_are_chosen_by_their_number_and_the_range_given() -> None:
    options = {"size": "60x44", "n": "9"}
    whole = SYNTHETIC.load("box", options, None)
    for more, labels in (
        ({"views": "3"}, "048"),
        ({"baseline": "2"}, "345"),
        ({"views": "5", "baseline": "4"}, "23456"),
    ):
        some = SYNTHETIC.load("box", options | more, None)
        assert ("".join(some.labels), some.labels[some.ref]) == (labels, "4")
        for name, mask in whole.regions.items():
            np.testing.assert_array_equal(mask, some.regions[name])
    given = SYNTHETIC.load("box", options | {"disparities": "-4:40"}, None)
    assert (given.disparities.least, given.disparities.largest) == (-1, 10)


def test_choosing_views_rescales() -> None:
    options = {"size": "60x44", "noise": "0"}
    whole, some = (SYNTHETIC.load("box", options | more, None) for more in ({}, {"views": "0:5:2"}))
    assert some.name == "synthetic/box[noise=0 size=60x44 views=0:5:2]"
    assert (some.labels, some.ref, some.pair_steps) == (("0", "2", "4"), 1, 1)
    np.testing.assert_array_equal(some.views, whole.views[::2])
    np.testing.assert_array_equal(some.truth[1], whole.truth[2] * 2)
    np.testing.assert_array_equal(some.visible[1], whole.visible[2][::2])
    np.testing.assert_array_equal(some.regions["disc"], whole.regions["disc"])


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("boxes", {}, "did you mean 'box'"),
        ("box", {"sed": "1"}, "n, noise, predict, ref, seed, size, views"),
        ("box", {"n": "1"}, "from 2 to 25"),
        ("box", {"n": "many"}, "from 2 to 25"),
        ("box", {"seed": "-1"}, "from 0"),
        ("box", {"noise": "nan"}, "0 to 50"),
        ("box", {"noise": "51"}, "0 to 50"),
        ("box", {"gain": "1"}, "from 0 to 0.9"),
        ("box", {"misaligned": "-1"}, "from 0 to 20"),
        ("box", {"size": "240"}, "WIDTHxHEIGHT"),
        ("box", {"size": "9999x9999"}, "1920x1440"),
        ("box", {"size": "100x300"}, "twice as high"),
        ("box", {"ref": "5"}, "0, 1, 2, 3, 4"),
        ("box", {"views": "0+1", "ref": "3"}, "not among"),
        ("box", {"views": "7:9"}, "at least two"),
    ],
)
def test_wrong_input_is_told_in_one_line(name: str, options: dict[str, str], words: str) -> None:
    with pytest.raises(UserError, match=words) as caught:
        SYNTHETIC.load(name, options, None)
    assert "\n" not in str(caught.value)


def test_listings_need_no_data(tmp_path: Path) -> None:
    assert SYNTHETIC.listings(None) == SYNTHETIC.listings(tmp_path)
    assert {listing.name: listing.present for listing in SYNTHETIC.listings(None)} == dict.fromkeys(WORLDS, True)
