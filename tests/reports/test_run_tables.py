"""The tables of a run folder: read as they are, and told where they cannot be relied on."""

from pathlib import Path

import pytest
from places import METHODS
from typing_commands import run as matbench

from matbench import comparison
from matbench.errors import UserError
from matbench.prepared import Comparison
from matbench.reports import run_tables


@pytest.fixture
def ready(tmp_path: Path) -> Comparison:
    made = comparison.prepare("flat[value=2,3]", "synthetic/box[size=48x36]", plugin=[METHODS], out=tmp_path / "run")
    made.run()
    return made


def test_a_whole_run_is_beyond_doubt_and_tables_alone_are_taken_as_they_are(ready: Comparison, tmp_path: Path) -> None:
    made = ready.tables()
    results, cells = run_tables.read_run(ready.folder)
    assert results["value"].to_numpy() == pytest.approx(made.results["value"].to_numpy(), nan_ok=True)
    assert len(cells) == 2
    assert run_tables.doubt(ready.folder) == ""
    alone = tmp_path / "alone"
    alone.mkdir()
    for name in ("results.csv", "cells.csv"):
        (alone / name).write_bytes((ready.folder / name).read_bytes()[: -40 if name == "results.csv" else None])
    assert len(run_tables.read_run(alone)[0]) <= len(results)
    assert run_tables.doubt(alone) == ""


def test_a_table_without_its_end_is_shown_with_what_to_type(
    ready: Comparison, capsys: pytest.CaptureFixture[str]
) -> None:
    ready.tables()
    table = ready.folder / "results.csv"
    lines = table.read_text().splitlines(keepends=True)
    table.write_text("".join(lines[: len(lines) // 2]))
    for command in (["report", "--format", "csv"], ["report"]):
        status, out, err = matbench(capsys, command[0], str(ready.folder), *command[1:])
        assert status == 0
        assert "flat" in out
        assert err == (
            f"matbench: the tables of {str(ready.folder)!r} are stale, they are not as they were written: "
            f"type matbench score {ready.folder}\n"
        )
    assert matbench(capsys, "score", str(ready.folder), "--plugin", str(METHODS))[0] == 0
    assert table.read_text() == "".join(lines)
    assert matbench(capsys, "report", str(ready.folder))[2] == ""


def test_a_run_that_was_killed_has_no_tables_yet(ready: Comparison, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = matbench(capsys, "report", str(ready.folder))
    assert (status, out) == (2, "")
    assert err == f"matbench: {str(ready.folder)!r} has no tables yet: type matbench score {ready.folder} first\n"


def test_a_damaged_table_of_a_run_is_told_with_what_to_type(ready: Comparison) -> None:
    ready.tables()
    (ready.folder / "results.csv").write_text("a,b\n1,2\n")
    with pytest.raises(UserError, match=rf"is damaged: .*; matbench score {ready.folder} makes it anew$"):
        run_tables.read_run(ready.folder)
    (ready.folder / "plan.json").unlink()
    with pytest.raises(UserError, match=r"results\.csv is damaged: [^;]*$"):
        run_tables.read_run(ready.folder)


def test_a_table_that_lacks_a_column_of_numbers_says_so(tmp_path: Path) -> None:
    (tmp_path / "sparsification.csv").write_text("algorithm,params,scene,coverage,best,pixels\na,,s,5,0,1\n")
    with pytest.raises(UserError, match=r"sparsification.csv is damaged: it has no column 'risk'$"):
        run_tables.read_points(tmp_path)
