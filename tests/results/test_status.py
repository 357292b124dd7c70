"""Where a run stands, from its folder alone."""

from contextlib import ExitStack
from pathlib import Path

import pytest
from finished_runs import SMALL, done
from forking import beside
from places import METHODS

from matbench import comparison
from matbench.errors import UserError
from matbench.results.status import prune, standing
from matbench.runs.lock import locked


def test_each_cell_counts_once(tmp_path: Path) -> None:
    folder = done(tmp_path / "run", "flat", "noise", "raises", "declines")
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    found = standing(folder)
    assert (found.cells, found.counts) == (4, {"ok": 2, "failed": 1, "skipped": 1})
    assert (found.failed, found.left, found.stale, found.tables) == (1, 1, 0, "")
    assert (found.work, list(found.running)) == (None, [])
    assert found.seconds_left is None, "nothing is known of the method that failed"
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before, "it only looks"


def test_what_is_left_takes_as_long_as_its_method_did(tmp_path: Path) -> None:
    ready = comparison.prepare("flat", SMALL, out=tmp_path / "run", seed=range(4), plugin=METHODS)
    ready.run()
    ready.tables()
    outcomes = [ready.store.outcome(cell) for cell in ready.plan.cells]
    took = [(one.seconds or 0) + (one.warmup_seconds or 0) for one in outcomes if one]
    for cell in ready.plan.cells[2:]:
        ready.store.remove(cell)
    found = standing(tmp_path / "run")
    assert found.left == 2
    assert found.seconds_left == pytest.approx(sum(took[:2]))
    assert found.tables == "cells were computed since"


def test_stale_cells_are_counted_and_removed(tmp_path: Path) -> None:
    plugin = tmp_path / "mine.py"
    plugin.write_text(METHODS.read_text())
    folder = done(tmp_path / "run", "flat", plugin=plugin)
    (old,) = folder.glob("cells/*")
    plugin.write_text(METHODS.read_text() + "\nOTHER = 1\n")
    done(folder, "flat", plugin=plugin)
    found = standing(folder)
    assert (found.cells, found.stale) == (1, 1)
    assert found.stale_bytes == sum(path.stat().st_size for path in old.rglob("*"))
    assert prune(folder) == 1
    assert not old.exists()
    assert prune(folder) == 0
    assert standing(folder).counts == {"ok": 1}


def test_while_a_process_works_on_it_nothing_is_removed(tmp_path: Path) -> None:
    folder = done(tmp_path / "run", "flat")
    held = ExitStack()

    def hold() -> int:
        return held.enter_context(locked(folder)).pid

    with beside(hold):
        assert standing(folder).counts == {"ok": 1}, "it can be looked at"
        with pytest.raises(UserError, match="in use"):
            prune(folder)
    assert prune(folder) == 0


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    for look in (standing, prune):
        with pytest.raises(UserError):
            look(tmp_path)
    assert list(tmp_path.iterdir()) == []
