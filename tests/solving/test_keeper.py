"""Whatever a method does to its process costs its cell alone; limits are enforced from outside."""

import re
from pathlib import Path

import pandas as pd
import psutil
import pytest
from attrs import evolve
from places import METHODS, ROUGH

from matbench import comparison
from matbench.plans.settings import Settings
from matbench.solving.environment import without_main
from matbench.solving.keeper import Keeper, dismiss
from matbench.solving.worker import Job

SMALL = "synthetic/box[size=96x72]"


def run(folder: Path, *algorithms: str, **settings: object) -> pd.DataFrame:
    ready = comparison.prepare(
        list(algorithms), SMALL, out=folder, plugin=[ROUGH, METHODS], settings=Settings(**settings)
    )
    ready.run()
    cells = ready.tables().cells.set_index("algorithm")
    cells["log"] = [(folder / "cells" / key / "log.txt").read_text(errors="replace") for key in cells.cell]
    assert not list((folder / "cells").glob(".*")), "no drafts"
    return cells


def below(pid: int | None = None) -> set[int]:
    """Processes below this one whose end is not merely unnoticed."""
    found = psutil.Process(pid).children(recursive=True)
    return {p.pid for p in found if p.is_running() and p.status() != psutil.STATUS_ZOMBIE}


EXPECTED = {
    "segfaults": ("crashed", "segmentation fault, SIGSEGV", "Fatal Python error: Segmentation fault"),
    "aborts": ("crashed", "SIGABRT", "in misbehave"),
    "exits": ("crashed", "exit status 7", ""),
    "leaves": ("failed", "SystemExit", ""),
    "overflows": ("crashed", "segmentation fault", "in deeper"),
    "loops": ("timeout", "stopped after 5 s", "in misbehave"),
    "allocates": ("out-of-memory", "MemoryError: Unable to allocate 1.00 TiB", "in misbehave"),
    "grows": ("out-of-memory", "400 MiB are its limit", "Grows begins"),
    "chatters": ("ok", "", "the last line, from C"),
    "upsets": ("ok", "", "Upsets begins"),
    "breeds": ("ok", "", "Breeds begins"),
    "scribbles": ("crashed", "wrote into a file of the harness", "Scribbles begins"),
    "splits": ("ok", "", "Splits begins"),
    "interrupts": ("interrupted", "KeyboardInterrupt", "in misbehave"),
    "tampers": ("failed", "the method wrote into its input", "Tampers begins"),
    "writes": ("failed", "read-only", "in solve"),
    "bare": ("failed", "ndarray, not an Estimate", ""),
    "orphans": ("crashed", "its keeper was killed", ""),
    "flat": ("ok", "", ""),
}


@pytest.mark.parametrize("isolation", ["process", "shared"])
def test_whatever_a_method_does_costs_its_cell_alone(tmp_path: Path, isolation: str) -> None:
    names = [name for name in EXPECTED if name not in ("orphans", "loops")]
    found = run(tmp_path / "run", *names, timeout=120, memory=400, isolation=isolation)
    for name in names:
        status, reason, printed = EXPECTED[name]
        assert found.status[name] == status, (name, found.reason[name], found.log[name][-2000:])
        assert reason in found.reason[name]
        assert printed in found.log[name], (name, found.log[name][-2000:])
    assert len(found.log["chatters"]) < 200_000
    assert re.search(r"\d+ bytes left out", found.log["chatters"])
    assert "line 31" in found.log["chatters"]
    assert not found.log["flat"]
    assert {"sleep"}.isdisjoint(psutil.Process(pid).name() for pid in below()), "what methods leave behind is ended"


def test_an_endless_loop_is_stopped(tmp_path: Path) -> None:
    found = run(tmp_path / "run", "loops", timeout=5)
    status, reason, printed = EXPECTED["loops"]
    log = f"(log: cells/{found.cell['loops']}/log.txt)"
    assert (found.status["loops"], found.reason["loops"]) == (status, f"{reason} {log}")
    assert printed in found.log["loops"]


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
