"""One's own scenes: what a scene.toml may say, and what is refused."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scene_files import Layers, check_one_line, pfm_bytes, write_png

from matbench import load_scene
from matbench.datasets.folder import describe, labels
from matbench.errors import UserError
from matbench.scene import Range
from matbench.scenes.catalogue import own_folder, select

WORLD = Layers(near=6.0, far=2.0)
TRUTH = WORLD.truth()
NAMES = ["left.png", "middle.png", "right.png"]
MINIMAL = f"views = {NAMES}\ndisparities = [0, 8]\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three views, and truth of the middle one in every encoding; no scene.toml."""
    folder = tmp_path / "my scene"
    folder.mkdir()
    for step, name in enumerate(NAMES):
        write_png(folder / name, WORLD.view(step - 1))
    truth = TRUTH.copy()
    truth[:3] = np.nan
    grey = np.nan_to_num(truth * 16).astype(np.uint16)
    write_png(folder / "grey8.png", grey.astype(np.uint8))
    write_png(folder / "grey16.png", grey * 256)
    (folder / "grey8.pgm").write_bytes(b"P5 96 80 255\n" + grey.astype(np.uint8).tobytes())
    (folder / "grey16.pgm").write_bytes(b"P5\n96 80\n65535\n" + (grey * 256).astype(">u2").tobytes())
    (folder / "map.pfm").write_bytes(pfm_bytes(truth))
    (folder / "map0.pfm").write_bytes(pfm_bytes(np.nan_to_num(truth), little=False))
    return folder


def _write(folder: Path, text: str) -> str:
    (folder / "scene.toml").write_text(text)
    return str(folder)


def _refused(folder: Path, text: str, *words: str) -> None:
    name = _write(folder, text)
    with pytest.raises(UserError) as caught:
        load_scene(name)
    message = str(caught.value)
    assert len(message.splitlines()) == 1, message
    assert all(word in message for word in words), message


def test_a_folder_of_views_is_a_scene(folder: Path) -> None:
    scene = load_scene(_write(folder, MINIMAL))
    assert scene.name == str(folder)
    assert scene.labels == ("0", "1", "2")
    assert scene.ref == 1
    assert scene.disparities == Range(0, 8)
    assert scene.pair_steps == 1
    assert not scene.truth
    for step, view in enumerate(scene.views):
        np.testing.assert_array_equal(view, WORLD.view(step - 1))


@pytest.mark.parametrize(
    "facts",
    [
        "file = 'grey8.png'\nscale = 16\nunknown = 0",
        "file = 'grey8.pgm'\nscale = 16.0\nunknown = 0\nencoding = 'grey8'",
        "file = 'grey16.png'\nscale = 4096\nunknown = 0\nencoding = 'grey16'",
        "file = 'grey16.pgm'\nscale = 4096\nunknown = 0",
        "file = 'map.pfm'",
        "file = 'map.pfm'\nscale = 1\nencoding = 'pfm'",
        "file = 'map0.pfm'\nunknown = 0",
    ],
)
@pytest.mark.parametrize("view", ["middle", "'middle.png'"])
def test_truth_in_every_encoding(folder: Path, facts: str, view: str) -> None:
    scene = load_scene(_write(folder, f"{MINIMAL}[truth.{view}]\n{facts}\n"))
    assert list(scene.truth) == [1]
    assert np.isnan(scene.truth[1][:3]).all()
    np.testing.assert_array_equal(scene.truth[1][3:], TRUTH[3:])
    assert scene.regions["all"].sum() == TRUTH[3:].size


def test_reference_and_pair(folder: Path) -> None:
    truth = "[truth.left]\nfile = 'map.pfm'\n[truth.middle]\nfile = 'map.pfm'\n"
    text = f"{MINIMAL}pair_steps = 2\nreference = 'left.png'\n{truth}"
    scene = load_scene(_write(folder, text))
    assert (scene.ref, scene.pair_steps) == (0, 2)
    _refused(folder, text.replace("'left.png'\n", "'middle'\n", 1), "pair_steps")
    assert load_scene(_write(folder, text) + "[views=0+2]").pair_steps == 1
    with pytest.raises(UserError, match="unknown option"):
        load_scene(f"{folder}[size=half]")


def test_labels_are_the_numbers_that_files_have() -> None:
    assert labels(["im2.png", "im6.png", "im10.png"]) == ("2", "6", "10")
    assert labels(["scene1.row3.col1.ppm", "scene1.row3.col2.ppm"]) == ("1", "2")
    assert labels(["im6.png", "im2.png"]) == ("0", "1"), "they must increase"
    assert labels(["a1.png", "b2.png"]) == ("0", "1"), "only numbers may differ"
    assert labels(["1a1.png", "2a2.png"]) == ("0", "1")


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
        ("views = ['left.png', 'a\\u0000b']\ndisparities = [0, 8]".replace("'", '"'), ["no file name"]),
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
    _refused(folder, text, *words)


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
    _refused(folder, text, "leads out of the folder", name)


def test_a_pipe_is_refused_and_not_waited_for(folder: Path) -> None:
    os.mkfifo(folder / "pipe.png")
    _refused(folder, "views = ['left.png', 'pipe.png']\ndisparities = [0, 8]", "pipe.png", "no file")
    (folder / "scene.toml").unlink()
    os.mkfifo(folder / "scene.toml")
    with pytest.raises(UserError, match="no file"):
        load_scene(str(folder))


def test_views_of_several_sizes_are_told_each(folder: Path) -> None:
    write_png(folder / "right.png", WORLD.view(1)[:70])
    write_png(folder / "grey8.png", TRUTH[:, :50].astype(np.uint8))
    name = _write(folder, MINIMAL + "[truth.middle]\nfile = 'grey8.png'\nscale = 16\n")
    with pytest.raises(UserError, match=r"right\.png is 96x70 px, not 96x80"):
        load_scene(name)
    (folder / "left.png").write_bytes((folder / "left.png").read_bytes()[:500])
    problems = describe(name).problems()
    assert ["left.png" in problems[0], "right.png" in problems[1], "grey8.png" in problems[2]] == [True] * 3
    assert len(problems) == 3


def test_a_folder_is_named_as_any_path(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _write(folder, MINIMAL)
    monkeypatch.chdir(folder.parent)
    monkeypatch.setenv("HOME", str(folder.parent))
    folder.rename("desk")
    for name in (
        "desk",
        "./desk",
        "desk/",
        "../" + folder.parent.name + "/desk",
        "folder/desk",
        "~/desk",
        str(Path("desk").resolve()),
    ):
        scene = load_scene(name)
        assert scene.n == 3
        assert load_scene(scene.name).digest == scene.digest, "its name loads it again"
    assert load_scene("desk").name == load_scene("folder/desk/").name == "./desk"
    assert load_scene("desk[views=0:2 ref=0]").name == "./desk[ref=0 views=0:2]"
    assert select("./d*").names == ("./desk",)
    assert [load_scene(name).name for name in select("d*[views=1:3]").names] == ["./desk[views=1:3]"]
    held = load_scene("desk[predict=right]")
    assert (held.name, held.n) == ("./desk[predict=right]", 2)
    Path("synthetic").mkdir()
    assert own_folder("synthetic") is None, "a dataset's name is a dataset"
    assert own_folder("./synthetic") == "./synthetic"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("./none", "scene folder './none' does not exist"),
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
