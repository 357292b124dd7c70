"""Keepers of processes: those that are killed are replaced, and processes are shared among cells."""

from pathlib import Path

from attrs import evolve
from misbehaviour import EXPECTED, SMALL
from places import METHODS, ROUGH

from matbench import comparison
from matbench.plans.settings import Settings
from matbench.solving.environment import without_main
from matbench.solving.keeper import Keeper, dismiss
from matbench.solving.worker import Job


def test_a_keeper_that_is_killed_is_replaced(tmp_path: Path) -> None:
    ready = comparison.prepare(["orphans", "flat"], SMALL, out=tmp_path / "run", plugin=[ROUGH, METHODS])
    seen: dict[str, str] = {}

    def listen(event: str, cell: object, outcome: object) -> None:
        if event == "done":
            seen[cell.method.algorithm] = f"{outcome.status} {outcome.reason}"  # type: ignore[attr-defined]

    ready.run(listen)
    assert seen["orphans"] == "crashed its keeper was killed"
    assert seen["flat"].startswith("ok")
    cells = ready.tables().cells.set_index("algorithm")
    assert (cells.status["orphans"], cells.reason["orphans"]) == EXPECTED["orphans"][:2], "the cell says so, too"
    assert not list((tmp_path / "run" / "cells").glob(".*")), "what the killed keeper left"


def test_a_cell_that_goes_wrong_when_it_is_done_again_is_not_what_it_was(tmp_path: Path) -> None:
    plugin = tmp_path / "turns.py"
    plugin.write_text(
        "import os, signal\nfrom pathlib import Path\nimport numpy as np\nfrom matbench import Estimate\n\n"
        "class Turns:\n    def solve(self, scene, context):\n"
        "        if Path(__file__).with_name('now').exists():\n            os.kill(os.getppid(), signal.SIGKILL)\n"
        "        return Estimate({scene.ref: np.ones(scene.views.shape[1:3], np.float32)})\n"
    )
    ready = comparison.prepare("turns", SMALL, out=tmp_path / "run", plugin=plugin)
    ready.run()
    assert ready.tables().cells.status.item() == "ok"
    (tmp_path / "now").touch()
    evolve(ready, settings=Settings(only="all")).run()
    assert ready.tables().cells.status.item() == "crashed"


def test_a_keeper_shares_a_process_among_cells_that_want_the_same(tmp_path: Path) -> None:
    ready = comparison.prepare(
        [f"tells[mark={mark}]" for mark in range(4)], SMALL, out=tmp_path / "run", plugin=[ROUGH, METHODS]
    )
    wanted = [("shared", 1), ("shared", 1), ("shared", 2), ("process", 2)]
    pids = []
    with without_main():
        keeper = Keeper()
    for cell, (isolation, threads) in zip(ready.plan.cells, wanted, strict=True):
        job = Job(ready.folder, cell, ready.plan.plugin_files, threads, Settings(isolation=isolation))
        keeper.begin(job)
        outcome, lives = keeper.outcome(job)
        assert (outcome.status, lives) == ("ok", True), outcome.reason
        pids.append(next(iter(ready.store.disparity(cell).values()))[0, 0])
    dismiss([keeper])
    assert pids[0] == pids[1]
    assert len(set(pids)) == 3
