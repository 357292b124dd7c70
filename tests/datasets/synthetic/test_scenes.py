"""Computed scenes: consistent, the same every time, as they are asked for."""

from pathlib import Path

import numpy as np
import pytest
from rigs import SMALL
from scenes_alike import alike

from matbench import code, load_scene
from matbench.datasets.synthetic import SYNTHETIC, WORLDS, materiality, scenes
from matbench.errors import UserError
from matbench.regions import textureless
from matbench.scene import Scene
from matbench.scenes import kept


@pytest.fixture(scope="module", params=sorted(WORLDS))
def scene(request: pytest.FixtureRequest) -> Scene:
    return SYNTHETIC.load(request.param, SMALL, None)


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
    found = {listing.name: listing.present for listing in SYNTHETIC.listings(None) if not listing.endless}
    assert found == dict.fromkeys(WORLDS, True)


OTHERWISE = {
    "matbench._moved": "old names only",
    "matbench.code": "imported by plug-ins",
    "matbench.datasets.synthetic.make_appearance": "makes the data, which count",
    "matbench.errors": "messages only",
    "matbench.parameters": "of methods",
    "matbench.safe_text": "messages only",
    "matbench.scenes.dataset": "no code but types",
    "matbench.space": "`materiality` only, which is not kept",
    "matbench.syntax": "imported by plug-ins",
    "matbench.typed": "of methods",
}
"""Modules that decide no pixel -> why."""


def test_all_code_and_data_that_decide_a_scene_are_known() -> None:
    """A module that is new here is either named among the sources of what is kept, or above with a reason."""
    own = Path(scenes.__file__).parent
    known = {path.resolve() for path in scenes._SOURCES}
    assert {path.resolve() for path in own.iterdir() if path.suffix not in (".pyc", "")} <= known
    parts = code.of_module(scenes.__name__).files
    others = {name for name, path in parts.items() if path.resolve() not in known}
    needless = {name for name in others if name.startswith(("matbench.files.", "matbench.plans.", "matbench.scenes."))}
    assert others - needless <= set(OTHERWISE)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv(kept.VARIABLE, "100")
    return tmp_path / "matbench" / "scenes"


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("world", SMALL | {"seed": "7"}),
        ("world-thin-3", SMALL | {"n": "7", "views": "3", "blur": "0.5"}),
        ("highlight", SMALL | {"gain": "0.2", "misaligned": "1.5", "ref": "1"}),
        ("spheres", SMALL | {"baseline": "2", "disparities": "0:21"}),
    ],
)
def test_a_scene_is_kept_to_the_bit(
    name: str, options: dict[str, str], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(kept.VARIABLE, "0")
    computed = SYNTHETIC.load(name, options, None)
    monkeypatch.setenv(kept.VARIABLE, "100")
    alike(SYNTHETIC.load(name, options, None), computed)
    assert len(list(cache.iterdir())) == 1
    monkeypatch.setattr(scenes, "_read", lambda *_: pytest.fail("it is computed although it is kept"))
    alike(SYNTHETIC.load(name, dict(reversed(options.items())), None), computed)
    alike(load_scene(f"synthetic/{name}[{' '.join(f'{key}={value}' for key, value in options.items())}]"), computed)


def test_each_name_and_option_is_a_scene_of_its_own(cache: Path) -> None:
    asked = [("box", SMALL), ("box", SMALL | {"noise": "2"}), ("weak", SMALL)]
    assert len({SYNTHETIC.load(name, options, None).digest for name, options in asked}) == 3
    assert len(list(cache.iterdir())) == 3


def test_what_cannot_be_is_refused_and_nothing_is_kept(cache: Path) -> None:
    for name, options in (("boxes", {}), ("world", {"seed": "x"}), ("box", {"views": "1"})):
        with pytest.raises(UserError):
            SYNTHETIC.load(name, options, None)
    assert not cache.exists()


def test_with_a_source_that_changed_nothing_is_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("matbench._LOADED", 0.0)
    SYNTHETIC.load("box", SMALL, None)
    assert not cache.exists()


def test_the_exact_volume_is_not_kept(cache: Path) -> None:
    materiality("box", SMALL)
    assert not cache.exists()
