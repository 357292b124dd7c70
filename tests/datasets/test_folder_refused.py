"""One's own scenes: what is wrong with a folder is one line."""

import os
from pathlib import Path

import numpy as np
import own_scenes
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from own_scenes import MINIMAL, NAMES, TRUTH, TRUTHFUL, WORLD, refused, write
from scene_files import check_one_line, write_png

from matbench import load_scene
from matbench.datasets import stored
from matbench.datasets.folder import describe
from matbench.errors import UserError
from matbench.scenes.catalogue import select


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return own_scenes.folder(tmp_path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["views is missing"]),
        ("views = ['left.png', 'right.png']", ["disparities is missing", "disparities = [0, 16]"]),
        (MINIMAL + "view = 1", ["unknown key", "'view'", "did you mean 'views'"]),
        (f"views = {NAMES}\ndisparities = [0, 1e9]", ["1000000000", "at most 9999"]),
        ("views = []\ndisparities = [0, 8]", ["0 files"]),
        ("views = ['left.png']\ndisparities = [0, 8]", ["1 files", "2 to 1000"]),
        ("views = 'left.png'\ndisparities = [0, 8]", ["'left.png'", "list"]),
        ("views = [1, 2]\ndisparities = [0, 8]", ["[1, 2]"]),
        ("views = ['left.png', 'left.png']\ndisparities = [0, 8]", ["'left.png' twice"]),
        ("views = ['left.png', 'none.png']\ndisparities = [0, 8]", ["none.png is missing"]),
        ("views = ['left.png', '']\ndisparities = [0, 8]", ["'' is no file name"]),
        ("views = ['left.png', '.']\ndisparities = [0, 8]", ["no file"]),
        ("views = ['left.png', 'a\\u0000b']\ndisparities = [0, 8]".replace("'", '"'), ["hidden character U+0000"]),
        (f"views = ['left.png', '{'x' * 5000}']\ndisparities = [0, 8]", ["no file name"]),
        (MINIMAL.replace("[0, 8]", "[8, 0]"), ["empty"]),
        (MINIMAL.replace("[0, 8]", "[0, nan]"), ["disparities"]),
        (MINIMAL.replace("[0, 8]", "[0, inf]"), ["disparities"]),
        (MINIMAL.replace("[0, 8]", "[0, true]"), ["disparities"]),
        (MINIMAL.replace("[0, 8]", "[0]"), ["disparities = [0]"]),
        (MINIMAL.replace("[0, 8]", "8"), ["disparities = 8"]),
        (MINIMAL.replace("[0, 8]", f"[0, {'9' * 400}]"), ["disparities"]),
        (MINIMAL.replace("[0, 8]", f"[0, {'9' * 5000}]"), ["not TOML"]),
        (MINIMAL + "pair_steps = 0", ["pair_steps = 0", "1 to 2"]),
        (MINIMAL + "pair_steps = 3", ["pair_steps = 3", "1 to 2"]),
        (MINIMAL + "pair_steps = 1.5", ["pair_steps = 1.5"]),
        (MINIMAL + "pair_steps = true", ["pair_steps = True"]),
        (MINIMAL + "positions = [0, 1]", ["positions = [0, 1]", "each of the 3 views", "[0, 1, 2.5]"]),
        (MINIMAL + "positions = [0, 1, 'x']", ["positions = "]),
        (MINIMAL + "positions = [0, 1, nan]", ["positions = "]),
        (MINIMAL + "positions = [0, 2, 1]", ["do not increase", "left to right"]),
        (MINIMAL + "positions = 3", ["positions = 3"]),
        (MINIMAL + "positions = [0, 1, 2.5]\npair_steps = 3", ["pair_steps = 3", "up to 2.5"]),
        (MINIMAL + "positions = [0, 1.5, 3.5]", ["no view lies 1 steps", "1.5, 2 steps away"]),
        (MINIMAL + "vertical = 1", ["vertical = 1", "neither true nor false"]),
        (MINIMAL.replace("left.png", "left.png "), ["'left.png ' begins or ends with a blank", "write 'left.png'"]),
        (MINIMAL.replace("left.png", "left\u2028.png"), ["names may hold only what can be seen"]),
        (MINIMAL + "reference = 'middle '", ["reference 'middle ' begins or ends with a blank"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm '", ["'map.pfm ' begins or ends with a blank"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nmask = 'none.png'", ["none.png is missing"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nmask = 'left.png'", ["left.png is coloured"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nmask = '../x'", ["leads out"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nsparse = 'no'", ["sparse = 'no'"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nencoding = 'sintel'", ["map.pfm"]),
        (MINIMAL + "pair_steps = 2", ["steps", "reference view 1"]),
        (MINIMAL + "reference = 'mittel'", ["unknown view", "'mittel'", "middle.png"]),
        (MINIMAL + "reference = 1", ["unknown view", "'1'"]),
        (MINIMAL + "truth = 'map.pfm'", ["truth = 'map.pfm'"]),
        (MINIMAL + "[truth]\nmiddle = 'map.pfm'", ["truth of middle", "'map.pfm'"]),
        (MINIMAL + "[truth.centre]\nfile = 'map.pfm'", ["unknown view", "'centre'"]),
        (MINIMAL + "[truth.middle]\nfile = 'none.pfm'", ["none.pfm is missing"]),
        (MINIMAL + "[truth.middle]\nscale = 1", ["None is no file name"]),
        (MINIMAL + "[truth.middle]\nfile = 'grey8.png'", ["lacks scale"]),
        (MINIMAL + "[truth.middle]\nfile = 'grey8.png'\nscale = 0", ["scale = 0"]),
        (MINIMAL + "[truth.middle]\nfile = 'grey8.png'\nscale = -4", ["scale = -4"]),
        (MINIMAL + "[truth.middle]\nfile = 'grey8.png'\nscale = nan", ["scale = nan"]),
        (MINIMAL + "[truth.middle]\nfile = 'grey8.png'\nscale = '4'", ["scale = '4'"]),
        (MINIMAL + "[truth.middle]\nfile = 'grey8.png'\nscale = 0.01", ["scale, 0.01, is not right"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nunknown = inf", ["unknown = inf"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nencoding = 'grey8'", ["encoding = 'grey8'", "is pfm"]),
        (MINIMAL + "[truth.middle]\nfile = 'map.pfm'\nscal = 2", ["unknown key", "'scale'"]),
        (MINIMAL + "[truth.middle]\nfile = 'left.png'\nscale = 1", ["coloured"]),
        (MINIMAL + "[truth.middle]\nfile='map.pfm'\n[truth.'middle.png']\nfile='map.pfm'", ["stands twice"]),
        (MINIMAL + "x = " + "[" * 5000, ["not TOML"]),
        ("views = ", ["not TOML"]),
    ],
)
def test_malformed_is_refused_in_one_line(folder: Path, text: str, words: list[str]) -> None:
    refused(folder, text, *words)


@pytest.mark.parametrize(
    "name", ["../outside.png", "/etc/hostname", "sub/../../outside.png", "link.png", "linked/o.png"]
)
@pytest.mark.parametrize("where", ["views", "truth"])
def test_nothing_outside_the_folder_is_read(folder: Path, name: str, where: str) -> None:
    outside = folder.parent / "outside.png"
    write_png(outside, WORLD.view(0))
    (folder / "link.png").symlink_to(outside)
    (folder / "linked").symlink_to(folder.parent)
    (folder.parent / "o.png").write_bytes(outside.read_bytes())
    (folder / "sub").mkdir()
    if where == "views":
        text = f"views = ['left.png', '{name}']\ndisparities = [0, 8]"
    else:
        text = f"{MINIMAL}[truth.middle]\nfile = '{name}'\nscale = 16"
    refused(folder, text, "leads out of the folder", name)


def test_views_that_no_memory_holds_are_refused_before_they_are_read(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One image under hundreds of spellings of its name."""
    monkeypatch.setattr(stored, "MOST_BYTES", 1 << 20)
    names = ["left.png", *(f"{'./' * k}right.png" for k in range(399))]
    text = f"views = {names}\ndisparities = [0, 8]"
    refused(folder, text, "claims 400 views of", "GiB of pixels are read")


def test_a_pipe_is_refused_and_not_waited_for(folder: Path) -> None:
    os.mkfifo(folder / "pipe.png")
    refused(folder, "views = ['left.png', 'pipe.png']\ndisparities = [0, 8]", "pipe.png", "no file")
    (folder / "scene.toml").unlink()
    os.mkfifo(folder / "scene.toml")
    with pytest.raises(UserError, match="no file"):
        load_scene(str(folder))


def test_views_of_several_sizes_are_told_each(folder: Path) -> None:
    write_png(folder / "right.png", WORLD.view(1)[:70])
    write_png(folder / "grey8.png", TRUTH[:, :50].astype(np.uint8))
    name = write(folder, MINIMAL + "[truth.middle]\nfile = 'grey8.png'\nscale = 16\n")
    with pytest.raises(UserError, match=r"right\.png is 96x70 px, not 96x80"):
        load_scene(name)
    (folder / "left.png").write_bytes((folder / "left.png").read_bytes()[:500])
    problems = describe(name).problems()
    assert ["left.png" in problems[0], "right.png" in problems[1], "grey8.png" in problems[2]] == [True] * 3
    assert len(problems) == 3


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("./none", "scene folder './none' does not exist"),
        ("./" + "x" * 300, "does not exist"),
        ("./a\0b", "holds the hidden character U+0000"),
        ("folder/none", "scene folder './none' does not exist"),
        ("empty", "holds no scene"),
        ("./no*", "no scene './no*' exists"),
        ("folder", "no dataset"),
        ("nothing/there", "unknown dataset 'nothing'"),
    ],
)
def test_what_is_no_scene_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, words: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError) as caught:
        load_scene(select(name).names[0])
    assert words in str(caught.value)


_VALUES = st.recursive(
    st.one_of(
        st.sampled_from(["'left.png'", "'right.png'", "'map.pfm'", "'../x'", "nan", "inf", "-1", "0", "1e400", "true"]),
        st.integers(-(10**30), 10**30).map(str),
        st.floats().map(lambda x: repr(x).replace("inf", "inf")),
        st.text("abc./\\ ", max_size=5).map(lambda text: f'"""{text}"""'.replace("\\", "\\\\")),
    ),
    lambda inner: st.lists(inner, max_size=3).map(lambda values: "[" + ", ".join(values) + "]"),
    max_leaves=4,
)


_LINES = st.lists(
    st.one_of(
        st.tuples(
            st.sampled_from(["views", "disparities", "pair_steps", "reference", "file", "scale", "unknown"]), _VALUES
        ).map(" = ".join),
        st.sampled_from(
            ["[truth.middle]", "[truth]", "[truth.left.x]", "[[truth]]", "views = ['left.png', 'right.png']"]
        ),
        st.sampled_from(["disparities = [0, 8]", "file = 'map.pfm'", "file = 'grey16.png'", "scale = 4096"]),
        st.text(max_size=12),
    ),
    max_size=7,
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.one_of(_LINES.map("\n".join).map(lambda text: text.encode("utf-8", "replace")), st.binary(max_size=60)))
def test_any_toml_is_a_right_scene_or_one_line(folder: Path, content: bytes) -> None:
    (folder / "scene.toml").write_bytes(content)
    try:
        scene = load_scene(str(folder))
    except UserError as error:
        check_one_line(error)
    else:
        assert scene.n >= 2
        assert np.isfinite([scene.disparities.least, scene.disparities.largest]).all()
        assert all(np.nanmax(np.abs(truth)) < 96 for truth in scene.truth.values())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MINIMAL + TRUTHFUL + "[regions]\nplanes = 'planes.png'\n", ("regions", "[regions.'left.png']")),
        ("regions = 3\n" + MINIMAL, ("regions = 3", "[regions.'left.png']")),
        (MINIMAL + "[regions.none]\nplanes = 'p.png'\n", ("view", "none", "left.png")),
        (MINIMAL + "[regions.middle]\nplanes = 3\n", ("3 is no file name",)),
        (MINIMAL + "[regions.middle]\nplanes = '../p.png'\n", ("leads out",)),
        (MINIMAL + "[regions.middle]\nall = 'p.png'\n", ("region 'all'", "another name")),
        (MINIMAL + "[regions.middle]\nseen_once = 'p.png'\n", ("region 'seen_once'", "another name")),
        (MINIMAL + TRUTHFUL + "[regions.middle]\nplanes = 'none.png'\n", ("none.png",)),
        ("metrics = 'kitty'\n" + MINIMAL, ("unknown metrics 'kitty'", "did you mean 'kitti'", "middlebury")),
        ("metrics = 3\n" + MINIMAL, ("unknown metrics '3'", "hci")),
        ("metrics = false\n" + MINIMAL, ("unknown metrics 'False'", "hci")),
    ],
)
def test_regions_and_metrics_that_are_wrong(folder: Path, text: str, words: tuple[str, ...]) -> None:
    refused(folder, text, *words)
