"""Computed scenes: exact geometry and visibility, the same every time."""

from pathlib import Path

import numpy as np
import pytest

from matbench.datasets.synthetic import SYNTHETIC, WORLDS
from matbench.datasets.synthetic.rendering import Rig
from matbench.datasets.synthetic.surfaces import Column, Paint, Rectangle, Sphere
from matbench.datasets.synthetic.textures import pattern
from matbench.errors import UserError
from matbench.scene import Scene

PINNED = [-0.699616, -0.784289, -0.679456, 0.839368, -0.569503, -0.892212]
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
                assert (there.max(axis=0) > truth)[hidden].mean() > 0.999


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
        ("box", {"sed": "1"}, "n, noise, ref, seed, size, views"),
        ("box", {"n": "1"}, "from 2 to 25"),
        ("box", {"n": "many"}, "from 2 to 25"),
        ("box", {"seed": "-1"}, "from 0"),
        ("box", {"noise": "nan"}, "0 to 50"),
        ("box", {"noise": "51"}, "0 to 50"),
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
    assert [(listing.name, listing.present) for listing in SYNTHETIC.listings(None)] == [
        ("box", True),
        ("curved", True),
        ("weak", True),
    ]
