"""`matbench export`: what it writes and what it says."""

from pathlib import Path

import pytest
from finished_runs import SMALL, done
from places import METHODS
from typing_commands import run

from matbench import comparison
from matbench.results.archive import export


def test_a_run_becomes_one_file_and_the_way_to_check_it_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = done(tmp_path / "my run", "flat")
    status, out, _ = run(capsys, "export", folder)
    archive = tmp_path / "my run.zip"
    assert (status, out.splitlines()) == (0, [f"archive: {archive}", f"to check it: matbench score '{archive}'"])
    assert archive.read_bytes() == export(folder, tmp_path / "other.zip")[0].read_bytes()


def test_cells_that_are_not_done_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = done(tmp_path / "run", "flat", "noise")
    ready = comparison.prepare(["flat", "noise"], SMALL, out=folder, plugin=METHODS)
    ready.store.remove(ready.plan.cells[1])
    ready.tables()
    status, out, _ = run(capsys, "export", folder, "--out", tmp_path / "half.zip")
    assert status == 0
    assert out.splitlines()[0] == "1 cells of the plan are not done, and so not in the archive"
    assert (tmp_path / "half.zip").is_file()


def test_what_is_no_run_is_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, "export", tmp_path)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert str(tmp_path) in err
    assert list(tmp_path.iterdir()) == []
