"""Two recordings in one: both are there whole, each under its side, and only of one scene."""

import subprocess
import sys
from pathlib import Path

import pytest
import rerun as rr
from small_recordings import rows, scene, write

from matbench.errors import UserError
from matbench.plans.record_option import RecordOption
from matbench.recording import side_by_side


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
