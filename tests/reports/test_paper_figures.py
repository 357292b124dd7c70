"""Figures for a paper: what they show is what the run holds, in the size of a column, letters embedded."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from attrs import evolve
from places import METHODS

from matbench import comparison, load_scene
from matbench.algorithm import Context
from matbench.cli import main
from matbench.errors import UserError
from matbench.plans.record_option import Recording
from matbench.plans.settings import Settings
from matbench.recording import coloring, drawing
from matbench.recording.probe import RecordingProbe
from matbench.reports import columns, maps, slices
from matbench.runs.store import Store
from matbench.scene import Range, Scene
from matbench.space import visibility

SMALL = "synthetic/box[size=96x72]"


def matbench(capsys: pytest.CaptureFixture[str], *tokens: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stop:
        main(tokens)
    said = capsys.readouterr()
    return int(stop.value.code or 0), said.out, said.err


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The literal method, one without a volume, and one of a user's own file."""
    folder = tmp_path_factory.mktemp("figures") / "run"
    chosen = ["materiality[preset=paper passes=3]", "okutomi_kanade", "flat"]
    comparison.prepare(chosen, SMALL, settings=Settings(), out=folder, plugin=METHODS).run()
    return folder


def test_a_slice_is_drawn_from_a_second_solve(run: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = ["figure", "slice", str(run), "materiality", "--row", "20", "-o", str(tmp_path / "two.pdf")]
    status, out, err = matbench(capsys, *line)
    assert (status, err) == (0, "")
    assert "differs" not in out
    assert {path.name for path in tmp_path.iterdir()} == {"two.pdf", "two.png", "two.txt", "two.tex"}
    pdf = (tmp_path / "two.pdf").read_bytes()
    assert b"/FontFile2" in pdf
    assert b"/Type3" not in pdf
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", pdf)
    assert box
    assert float(box[1]) == pytest.approx(3.25 * 72, abs=1)
    assert float(box[2]) < columns.TALLEST * 72
    picture = cv2.imread(str(tmp_path / "two.png"))
    assert picture is not None
    assert picture.shape[1] == pytest.approx(3.25 * columns.DOTS, abs=2)
    caption = (tmp_path / "two.txt").read_text()
    for told in ("row 20", SMALL, "materiality[preset=paper passes=3]", "after 3 passes", "px per view step", "(f)"):
        assert told in caption
    assert r"\includegraphics[width=3.25in]{two}" in (tmp_path / "two.tex").read_text()


def test_slices_are_the_arrays_told() -> None:
    """Each picture against the method's own arrays."""
    from matbench.algorithms.materiality import Materiality

    scene = load_scene(SMALL)
    method = evolve(Materiality(**Materiality.presets["paper"]), passes=2)  # type: ignore[arg-type]
    probe = RecordingProbe(Recording(rows=(20,)))
    told = {}

    class Both(RecordingProbe):
        def volume(self, name, volume):  # type: ignore[no-untyped-def]
            told[name] = volume.values[20].copy()
            super().volume(name, volume)

    probe = Both(Recording(rows=(20,)))
    estimate = method.solve(scene, Context(0, 1, probe))
    plane = slices.epipolar_plane(scene, probe, estimate)
    assert plane is not None
    assert estimate.volume is not None
    pictures = {one.name: one.picture for one in plane.slices}
    assert list(pictures) == ["similarity", "visibility", "materiality", "energy derivative"]
    pairs = np.stack([drawing.as_bytes(values) for values in told.values()], axis=2)
    assert np.array_equal(pictures["similarity"], pairs)
    assert np.array_equal(pictures["materiality"][:, :, 1], drawing.as_bytes(estimate.volume.values[20]))
    seen = drawing.as_bytes(visibility(estimate.volume, 0)[20])
    assert np.array_equal(pictures["visibility"][:, :, 0], seen)
    drawn = slices.draw(scene, plane, "m")
    top = [axis.images[0].get_array() for axis in drawn.figure.axes[:2]]
    assert np.array_equal(top[0], scene.views[scene.ref])
    assert np.array_equal(drawn.figure.axes[4].images[0].get_array(), pictures["materiality"][::-1])
    first = scene.labels[estimate.volume.views[0]]
    assert f"view {first}," in drawn.caption


def test_maps_are_those_of_the_run(run: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = ["figure", "maps", str(run), "-a", "materiality", "okutomi", "--errors", "-o", str(tmp_path / "three")]
    assert matbench(capsys, *line)[0] == 0
    caption = (tmp_path / "three.txt").read_text()
    assert SMALL in caption
    assert "(c) materiality[preset=paper passes=3]; (d) its errors" in caption
    assert "flat" not in caption
    scene, store = load_scene(SMALL), Store(run)
    cell = next(c for c in store.plan().cells if c.method.algorithm == "okutomi_kanade")
    stored = store.disparity(cell)[scene.ref]
    drawn = maps.draw(maps.Maps((scene,), ("ok",), {("ok", SMALL): stored}))
    shown = [axis.images[0].get_array() for axis in drawn.figure.axes]
    ends = coloring.disparity_ends(scene)
    assert np.array_equal(shown[0], scene.views[scene.ref])
    assert np.array_equal(shown[1], coloring.truth_colors(scene.truth[scene.ref], ends))
    assert np.array_equal(shown[2], coloring.disparity_colors(stored, ends))


def made(name: str, truth: bool = True) -> Scene:
    values = np.tile(np.linspace(1, 4, 24, dtype=np.float32), (16, 1))
    views = np.zeros((2, 16, 24, 3), np.uint8)
    return Scene(name, views, ("a", "b"), 0, Range(0, 5), {0: values} if truth else {}, 1.0)


def test_many_scenes_go_on_in_the_next_line_until_the_page_is_full() -> None:
    scenes = tuple(made(f"made/{i}") for i in range(6))
    found = {("m", scene.name): scene.truth[0] for scene in scenes[1:]}
    drawn = maps.draw(maps.Maps(scenes, ("m",), found))
    assert len(drawn.figure.axes) == 18
    assert drawn.figure.get_figwidth() == 3.25
    assert "Without a map: m on made/0." in drawn.caption
    assert [text.get_text() for text in drawn.figure.texts].count("(c)") == 2
    with pytest.raises(UserError, match="more than a page holds"):
        maps.draw(maps.Maps(scenes, tuple("abcdefghijklmnop"), {}), errors=True)


def test_hostile_names_are_only_letters(tmp_path: Path) -> None:
    scene = made("made/$x$_^{\\a}%<b>", truth=False)
    drawn = maps.draw(maps.Maps((scene,), ("$m_1",), {("$m_1", scene.name): np.zeros((16, 24), np.float32)}))
    paths = columns.write_figure(drawn, tmp_path / "f")
    assert [path.suffix for path in paths] == [".pdf", ".png", ".txt", ".tex"]
    assert r"\$m\_1" in paths[3].read_text()
    again = columns.write_figure(drawn, tmp_path / "g")
    assert paths[0].read_bytes() == again[0].read_bytes()


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["slice", "RUN"], "there are 3 cells: name one of materiality[preset=paper passes=3] on "),
        (["slice", "RUN", "sgbm"], "0 cells match 'sgbm'"),
        (["slice", "RUN", "materiality", "--row", "72"], f"row 72 of {SMALL}: 0 to 71 is possible"),
        (["slice", "RUN", "materiality", "--row", "1,2"], "a figure shows one"),
        (["slice", "RUN", "materiality", "--row", "x"], "row 'x' is not a whole number"),
        (["slice", "RUN", "okutomi"], "okutomi_kanade tells nothing of disparity space"),
        (["slice", "RUN", "flat"], "flat is in a file of its own: add --plugin"),
        (["slice", "RUN", "materiality", "-o", "/no/such/x"], "folder '/no/such' of --out does not exist"),
        (["maps", "RUN", "-s", "teddy"], "no scene of this run is or contains 'teddy'"),
        (["maps", "RUN", "-a", "sgbm"], "no method of this run is or contains 'sgbm'"),
        (["maps", "/no/such/run"], "give a run folder"),
    ],
)
def test_wrong_usage_is_one_line(run: Path, capsys: pytest.CaptureFixture[str], tokens: list[str], said: str) -> None:
    before = sorted(run.iterdir())
    status, _, err = matbench(capsys, "figure", *(str(run) if one == "RUN" else one for one in tokens))
    assert (status, err.count("\n")) == (2, 1)
    assert said in err
    assert sorted(run.iterdir()) == before


def test_a_method_of_a_file_needs_the_file(run: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = ["figure", "slice", str(run), "flat", "--plugin", str(METHODS), "-o", str(tmp_path / "x")]
    assert "flat tells nothing of disparity space" in matbench(capsys, *line)[2]
