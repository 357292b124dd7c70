"""Two recordings in one: both are there whole, each under its side, and only of one scene."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from attrs import evolve

from matbench.algorithm import Estimate, Probe
from matbench.cli import main
from matbench.errors import UserError
from matbench.plans.record_option import RecordOption
from matbench.recording import blueprint, side_by_side
from matbench.recording.blueprint import Contents
from matbench.recording.rrd import record
from matbench.scene import Range, Scene
from matbench.space import DisparitySpace, Volume


def scene(name: str = "toy/box") -> Scene:
    random = np.random.default_rng(sum(map(ord, name)))
    views = random.integers(0, 256, (3, 12, 20, 3), dtype=np.uint8)
    truth = np.full((12, 20), 2, np.float32)
    return Scene(name, views, ("a", "b", "c"), 1, Range(0, 5), {1: truth}, 1.0, {"all": np.isfinite(truth)})


def write(path: Path, of: Scene, title: str, passes: int, wanted: RecordOption = RecordOption()) -> Path:  # noqa: B008
    """A method with a volume and several passes, or, with none, only a map."""
    space = DisparitySpace.covering(of.disparities, of.n, of.height, of.width)
    volume = Volume(space, np.random.default_rng(passes).random(space.shape, np.float32), (0, 1, 2))
    answer = np.full((12, 20), 1 + passes, np.float32)

    def solve(probe: Probe) -> Estimate:
        for step in range(passes):
            probe.iteration(step, {"total": float(-step)}, volume, volume, answer)
        return Estimate({1: answer}, volume if passes else None)

    record(path, of, solve, title=title, wanted=wanted)
    return path


def rows(path: Path) -> dict[str, list[object]]:
    """Entity -> every row without its identity; chunks may be cut otherwise."""
    found: dict[str, list[object]] = {}
    for chunk in rr.chunk.RrdReader(path).stream():
        for row in chunk.to_record_batch().to_pylist():
            told = {name: value for name, value in row.items() if not name.endswith("RowId")}
            found.setdefault(str(chunk.entity_path), []).append(told)
    return {name: sorted(told, key=lambda row: row.get("iteration", -1)) for name, told in found.items()}  # type: ignore[attr-defined]


def test_both_are_there_whole(tmp_path: Path) -> None:
    one = write(tmp_path / "1.rrd", scene(), "m on toy/box", 3)
    other = write(tmp_path / "2.rrd", scene(), "n on toy/box", 0)
    side_by_side.merge(tmp_path / "both.rrd", one, other)
    merged = rows(tmp_path / "both.rrd")
    for side, source in (("A", one), ("B", other)):
        for entity, told in rows(source).items():
            if not entity.startswith("/__"):
                assert merged.pop(f"/{side}{entity}") == told
    assert set(merged) <= {"/__properties"}
    verify = [sys.executable, "-m", "rerun_cli", "rrd", "verify", str(tmp_path / "both.rrd")]
    done = subprocess.run(verify, capture_output=True, text=True, check=True)
    assert "1 file verified without error" in done.stdout + done.stderr
    reader = rr.chunk.RrdReader(tmp_path / "both.rrd")
    assert (len(reader.recordings()), len(reader.blueprints())) == (1, 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1.rrd", "2.rrd", "both.rrd"]


def test_two_scenes_are_refused(tmp_path: Path) -> None:
    one = write(tmp_path / "1.rrd", scene(), "m on toy/box", 1)
    other = write(tmp_path / "2.rrd", scene("toy/other"), "m on toy/other", 1)
    with pytest.raises(UserError, match="'m on toy/box' and 'm on toy/other' are of different scenes"):
        side_by_side.merge(tmp_path / "both.rrd", one, other)
    (tmp_path / "3.rrd").write_bytes(one.read_bytes()[:500])
    with pytest.raises(UserError, match=r"cannot be read|does not say"):
        side_by_side.merge(tmp_path / "both.rrd", one, tmp_path / "3.rrd")
    assert not (tmp_path / "both.rrd").exists()


def test_what_a_recording_notes_of_itself_is_read_back(tmp_path: Path) -> None:
    contents = side_by_side.contents_of(write(tmp_path / "1.rrd", scene(), "m on toy/box", 3))
    assert (contents.title, contents.method, contents.scene) == ("m on toy/box", "m", scene().digest)
    assert contents.told == {"total": [0.0, -1.0, -2.0]}
    assert contents.error_rates == {"all": [100.0] * 3}
    assert [s.row for s in contents.slices] == [6]
    assert list(contents.slices[0].paths) == ["visibility", "materiality", "derivative"]


@pytest.mark.parametrize(
    ("chosen", "has", "lacks"),
    [
        (["slices"], ["/slices/6/materiality"], ["/volumes", "/haze", "/space", "/surface", "/passes"]),
        (["volumes,passes=2"], ["/volumes/materiality", "/passes/disparity"], ["/slices", "/space", "/surface"]),
        (["surface", "space"], ["/surface/points", "/space/materiality"], ["/slices", "/volumes", "/passes"]),
    ],
)
def test_only_what_was_chosen_is_recorded(tmp_path: Path, chosen: list[str], has: list[str], lacks: list[str]) -> None:
    found = rows(write(tmp_path / "1.rrd", scene(), "m on toy/box", 5, RecordOption.of(chosen)))
    assert set(has) <= set(found)
    assert not [entity for entity in found if entity.startswith(tuple(lacks))]
    assert {"/estimate/error", "/energy/total", "/regions/all"} <= set(found), "these always are"
    if "/passes/disparity" in found:
        assert [row["iteration"] for row in found["/passes/disparity"]] == [0, 4]  # type: ignore[index]


def views_of(contents: Contents) -> list[str]:
    def names(part: object) -> list[str]:
        inner = [name for child in getattr(part, "contents", ()) or () for name in names(child)]
        own = getattr(part, "name", None)
        return ([str(own)] if own else []) + inner

    return names(blueprint.layout(contents).root_container)


def test_panels_are_for_what_is_there(tmp_path: Path) -> None:
    """One blueprint for each kind of method."""
    with_volume = side_by_side.contents_of(write(tmp_path / "1.rrd", scene(), "m on toy/box", 3))
    once = side_by_side.contents_of(write(tmp_path / "2.rrd", scene(), "m on toy/box", 1))
    only_map = side_by_side.contents_of(write(tmp_path / "3.rrd", scene(), "m on toy/box", 0))
    names = views_of(with_volume)
    for name in ("Energy of each pass", "Error of each pass, total_bad_1 in %", "Epipolar slices, row 6", "Volumes"):
        assert name in names
    assert "Materiality in disparity space" in names
    assert not [name for name in views_of(once) if "each pass" in name], "one point is no curve"
    assert "**total**, told once: 0" in rows(tmp_path / "2.rrd")["/about"][0]["TextDocument:text"][0]  # type: ignore[index]
    names = views_of(only_map)
    assert "Answer in disparity space" in names
    assert not [name for name in names if name.startswith(("Epipolar", "Volumes", "Materiality"))]
    changed = evolve(once, told={"changed": [0.5, 0.1]})
    assert "Changed of each pass" in views_of(changed)


def test_choices_are_read_and_compared() -> None:
    assert RecordOption.of() == RecordOption(), "without parts, all of them"
    assert RecordOption.of(["slices,passes=10"]) == RecordOption(True, False, False, False, 10)
    assert RecordOption.of(["all"], "9,3,9").rows == (3, 9)
    assert RecordOption.of(["passes"]).passes == 20
    full = RecordOption().at(20)
    assert full.rows == (10,)
    assert full.covers(RecordOption())
    assert full.covers(RecordOption.of(["slices,passes=5"], "10"))
    assert not full.covers(RecordOption(rows=(3,)))
    assert not RecordOption.of(["slices"], "10").covers(full)


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["compare", "--record", "slice", "-s", "synthetic/box"], "unknown part 'slice' of a recording: did you mean"),
        (["compare", "-s", "synthetic/box", "--record", "passes=x"], "passes 'x' is not a whole number from 0 to 200"),
        (["compare", "-s", "synthetic/box", "--record", "--rows", "5,"], "row '' is not a whole number"),
        (["compare", "-s", "synthetic/box", "--record", "--rows", "5,999"], "row 999 of synthetic/box: 0 to"),
        (["view", "x.rrd", "--compare", "a", "b"], "--compare takes two cells of a run"),
    ],
)
def test_wrong_choices_are_one_line(
    tokens: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main(tokens)
    err = capsys.readouterr().err
    assert (stop.value.code, err.count("\n")) == (2, 1)
    assert said in err
    assert list(tmp_path.iterdir()) == []
