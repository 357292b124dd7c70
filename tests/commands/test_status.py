"""`matbench status`: what it says of a run."""

import json
import time
from pathlib import Path

import pytest
from finished_runs import done
from places import METHODS
from typing_commands import run

from matbench.commands.status import _json, _lines
from matbench.plans.plan import Cell, Method
from matbench.results.status import Standing
from matbench.runs.lock import Work


def test_a_finished_run_and_cells_of_other_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plugin = tmp_path / "mine.py"
    plugin.write_text(METHODS.read_text())
    folder = done(tmp_path / "run", "flat", "raises", plugin=plugin)
    status, out, _ = run(capsys, "status", folder)
    assert (status, out.splitlines()[0]) == (0, f"{folder}: 1 of 2 cells done, 1 left (1 ok, 1 failed)")
    assert "not running: the command that began it goes on from here" in out
    told = json.loads(run(capsys, "status", folder, "--json")[1])
    assert (told["cells"], told["done"], told["failed"], told["left"], told["tables"]) == (2, 1, 1, 1, "current")

    plugin.write_text(METHODS.read_text() + "\nOTHER = 1\n")
    done(folder, "flat", "raises", plugin=plugin)
    assert "2 stored cells (" in run(capsys, "status", folder)[1]
    out = run(capsys, "status", folder, "--prune")[1]
    assert out.splitlines()[0] == "2 stored cells of other code or pixels removed"
    assert len(list(folder.glob("cells/*"))) == 2


def test_a_run_under_way_names_what_runs_and_guesses_the_rest() -> None:
    work = Work(Path("run"), 4711, "host", time.time() - 90)
    cell = Cell(Method("flat", {}), "synthetic/box", "", 0, "0" * 16)
    found = Standing(Path("run"), 5, {"ok": 2, "failed": 1}, [(cell, 61.0)], work, 3, 125.0)
    lines = _lines(found)
    assert lines[0] == "run: 2 of 5 cells done, 3 left (2 ok, 1 failed)"
    assert "process 4711 on host" in lines[1]
    assert lines[2].strip().startswith(f"{cell}, for ")
    assert lines[-1].startswith("time left: about ")
    told = _json(found)
    assert told["process"] == {"pid": 4711, "host": "host", "seconds": pytest.approx(90, abs=30)}
    assert told["running"] == [{"cell": str(cell), "key": cell.key, "seconds": 61.0}]


def test_stale_tables_are_said_only_when_nobody_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stale = Standing(Path("my run"), 1, {"ok": 1}, tables="cells were computed since")
    (tmp_path / "my run").mkdir()
    monkeypatch.chdir(tmp_path)
    assert _lines(stale)[-1] == "tables are stale, cells were computed since: type matbench score 'my run'"
    work = Work(Path("r"))
    assert not [line for line in _lines(Standing(Path("r"), 1, {}, work=work, left=1, tables="old")) if "stale" in line]
