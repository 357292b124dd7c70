"""`matbench scene` as it is typed."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scene_files import write_png

from matbench import load_scene
from matbench.cli import main


def run(capsys: pytest.CaptureFixture[str], *tokens: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as done:
        main(tokens)
    captured = capsys.readouterr()
    return int(done.value.code or 0), captured.out, captured.err


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of views beside where one works."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "desk"
    folder.mkdir()
    scene = load_scene("synthetic/box[size=240x180]")
    for number, view in enumerate(scene.views):
        write_png(folder / f"view{number}.png", view)
    write_png(folder / "truth2.png", np.rint(scene.truth[2] * 32).astype(np.uint16))
    return folder


def test_from_a_folder_of_images_to_a_comparison(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    status, out, _ = run(capsys, "scene", "new", "desk")
    assert status == 0
    assert "written: desk/scene.toml" in out
    path = folder / "scene.toml"
    text = path.read_text()
    for line in ('[truth."view2.png"]', 'file = "truth2.png"', "scale = 16", "unknown = 0"):
        text = text.replace(f"# {line}", line)
    path.write_text(text)
    status, out, _ = run(capsys, "scene", "check", "desk")
    assert status == 1
    assert "✗ truth of view2.png" in out, "its scale is 32"
    assert "half of it: is its scale right?" in out
    path.write_text(text.replace("scale = 16", "scale = 32"))
    status, out, _ = run(capsys, "scene", "check", "desk")
    assert status == 0, out
    assert "no problems" in out
    status, out, _ = run(capsys, "compare", "-a", "okutomi_kanade[window=5]", "-s", "desk", "--out", "run")
    assert status == 0, out
    assert "desk" in out
    assert (folder.parent / "run/report.html").exists()


def test_a_folder_with_brackets_and_commas_is_named_in_quotes(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    folder.rename(folder.parent / "scans [2], a")
    status, out, _ = run(capsys, "scene", "new", "scans [2], a")
    assert status == 0
    assert out.splitlines()[-1] == """next: matbench scene check '"./scans [2], a"'"""
    status, out, _ = run(capsys, "scene", "check", '"./scans [2], a"')
    assert status == 0, out
    assert load_scene('"scans [2], a"[views=0+1]').name == '"./scans [2], a"[views=0+1]'
    status, _, err = run(capsys, "scene", "check", "scans [2], a")
    assert status == 2
    assert "a name with brackets or commas stands in quotes of its own" in err


def test_views_one_below_the_other_are_said_to_be_turned(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    for file in folder.glob("view*.png"):
        write_png(file, np.rot90(cv2.imread(str(file))[..., ::-1], -1))
    (folder / "truth2.png").unlink()
    assert run(capsys, "scene", "new", "desk")[0] == 0
    status, out, _ = run(capsys, "scene", "check", "desk")
    assert status == 0, out
    assert "turned: they were taken one below the other, so all are turned by a quarter, counter-clockwise" in out


@pytest.mark.parametrize("count", [2, 3])
def test_pictures_that_do_not_belong_together_are_not_confirmed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    """What is unknown is not good, and no advice is given that cannot be followed."""
    monkeypatch.chdir(tmp_path)
    Path("my desk").mkdir()
    for number, name in enumerate(("box", "fence", "spheres")[:count]):
        write_png(
            Path(f"my desk/{number}.png"), load_scene(f"synthetic/{name}[n=2 seed={number} size=240x180]").views[0]
        )
    status, out, _ = run(capsys, "scene", "new", "my desk")
    assert (status, out.splitlines()[-1]) == (0, "next: matbench scene check './my desk'")
    assert "A GUESS" in out
    status, out, _ = run(capsys, "scene", "check", "./my desk")
    assert status == 1
    assert "no problems" not in out
    assert "not confirmed: order, shift, rows could not be measured" in out
    assert ("[predict=" in out) == (count > 2)
    status, _, err = run(capsys, "compare", "-a", "sgbm", "-s", "./my desk", "--out", "run")
    assert status == 2
    assert ("[predict=" in err) == (count > 2)
    if count > 2:
        assert "needs [predict=left] or [predict=right] after the scene" in err
        assert (
            run(capsys, "compare", "-a", "sgbm", "-s", "./my desk[predict=left]", "--dry-run", "--out", "run")[0] == 0
        )
    else:
        assert "needs ground truth, or a third view" in err


def test_check_lists_every_file_that_is_wrong(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    run(capsys, "scene", "new", "desk", "--disparities", "0", "8")
    write_png(folder / "view1.png", np.zeros((20, 30, 3), np.uint8))
    (folder / "view3.png").unlink()
    status, out, err = run(capsys, "scene", "check", "./desk/")
    assert (status, err) == (1, "")
    assert "view1.png is 30x20 px, not 240x180" in out
    assert "view3.png is missing" in out


def test_check_takes_the_name_of_any_scene(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "scene", "check", "synthetic/weak[n=3]")
    assert status == 0
    assert out.count("✓") == 4 + 3
    assert out.endswith("no problems\n")


def test_show_writes_a_sheet_and_a_recording(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    status, out, _ = run(capsys, "scene", "show", "synthetic/curved[n=3 size=96x72]", "--record")
    assert status == 0
    sheet, recording = (
        Path("scene-synthetic-curved-n-3-size-96x72.png"),
        Path("scene-synthetic-curved-n-3-size-96x72.rrd"),
    )
    assert cv2.imread(str(sheet)) is not None
    assert f"contact sheet: {sheet}" in out
    assert f"matbench view {recording}" in out
    assert recording.stat().st_size > 10_000
    run(capsys, "scene", "new", "desk")
    status, out, _ = run(capsys, "scene", "show", "desk", "-o", "mine.png")
    assert out == "contact sheet: mine.png\n"
    assert cv2.imread("mine.png") is not None
    assert sorted(path.name for path in Path().iterdir()) == sorted(["desk", "mine.png", str(sheet), str(recording)])


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["show"], "no scene"),
        (["show", "synthetic/bx"], "unknown scene 'bx' of synthetic"),
        (["show", "synthetic/box", "synthetic/weak", "-o", "x.png"], "one file for 2 scenes"),
        (["show", "synthetic/box", "-o", "x.jpg"], "must end in .png"),
        (["show", "synthetic/box", "-o", "no/x.png"], "folder 'no' of --out does not exist"),
        (["check", "none"], "scene folder 'none' does not exist"),
        (["check", "desk"], "holds no scene"),
        (["check", "nowhere/none"], "unknown dataset 'nowhere'"),
        (["new", "none"], "folder 'none' does not exist"),
        (["new", "desk", "--disparities", "9", "1"], "empty"),
        (["new", "desk", "--disparities", "9"], "disparities"),
        (["nwe", "desk"], "nwe"),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(
    capsys: pytest.CaptureFixture[str], folder: Path, tokens: list[str], said: str
) -> None:
    before = sorted(folder.parent.rglob("*"))
    status, _, err = run(capsys, "scene", *tokens)
    assert status == 2
    assert said in err
    assert err.count("\n") == 1
    assert "Traceback" not in err
    assert sorted(folder.parent.rglob("*")) == before
