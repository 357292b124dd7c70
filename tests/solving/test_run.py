"""Computing the cells of a plan: what is done once more, and what methods may not change."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest
from places import METHODS, ROUGH

from matbench import comparison
from matbench.errors import UserError
from matbench.plans import limits
from matbench.plans.settings import Settings
from matbench.rescoring import open_run
from matbench.runs.outcome import Outcome
from matbench.runs.todo import explained
from matbench.solving import confinement

SMALL = "synthetic/box[size=96x72]"


SCENE = "synthetic/box[size=48x36]"


REACHES = '''
import json
import os
from pathlib import Path

import numpy as np

from matbench import Estimate


class Reaches:
    """Makes the cells of others better, where it can."""

    def solve(self, scene, context):
        if scene.width > 64 or scene.height > 16:
            for path in Path(os.environ["CELLS"]).glob("*/cell.json"):
                facts = json.loads(path.read_text())
                facts["outcome"]["seconds"] = 1e-6
                try:
                    path.write_text(json.dumps(facts))
                    print("changed", path.parent.name)
                except OSError as error:
                    print("refused:", error.strerror)
        return Estimate({scene.ref: np.zeros((scene.height, scene.width), np.float32)})
'''


def compared(tmp_path: Path, *options: str, **environment: str) -> comparison.Comparison:
    """A run by the command line, in a process of its own whose keepers know this environment."""
    (tmp_path / "reaches.py").write_text(REACHES)
    plugins = ["--plugin", str(METHODS), "--plugin", str(tmp_path / "reaches.py")]
    line = [
        sys.executable,
        "-m",
        "matbench",
        "compare",
        *plugins,
        "-s",
        SCENE,
        "--out",
        str(tmp_path / "run"),
        *options,
    ]
    variables = {**os.environ, "CELLS": str(tmp_path / "run" / "cells"), **environment}
    subprocess.run(line, env=variables, capture_output=True, timeout=300, check=False)
    ready, _ = open_run(tmp_path / "run")
    return ready


def outcome_of(ready: comparison.Comparison, name: str) -> Outcome:
    (found,) = (ready.store.outcome(cell) for cell in ready.plan.cells if cell.method.algorithm == name)
    assert found is not None
    return found


@pytest.mark.skipif(not confinement.is_possible(), reason="this system lets nobody mount in a namespace of their own")
def test_a_method_can_not_change_what_was_solved(tmp_path: Path) -> None:
    ready = compared(tmp_path, "-a", "flat", "reaches")
    flat, reaches = outcome_of(ready, "flat"), outcome_of(ready, "reaches")
    assert flat.status == reaches.status == "ok"
    assert flat.seconds != 1e-6
    assert flat.ran_on["run folder"] == "read-only for methods"
    logs = [(ready.store.cell(cell) / "log.txt").read_text() for cell in ready.plan.cells]
    assert any("refused: Read-only file system" in log for log in logs)


def test_what_a_method_changed_is_found_out(tmp_path: Path) -> None:
    ready = compared(tmp_path, "-a", "flat", "reaches", MATBENCH_UNCONFINED="1")
    flat = outcome_of(ready, "flat")
    assert flat.status == "failed"
    assert "changed by a method" in flat.reason
    assert outcome_of(ready, "reaches").status == "ok"


def test_what_others_disturbed_is_solved_once_more(tmp_path: Path) -> None:
    begun: list[str] = []
    settings = Settings(jobs=2, steady=True)
    ready = comparison.prepare(["flat", "noise"], SCENE, plugin=METHODS, out=tmp_path / "run", settings=settings)
    ready.run(lambda event, cell, _: begun.append(str(cell)) if event == "start" else None)
    # two at once are never alone: both are solved once more
    assert sorted(begun) == sorted([str(cell) for cell in ready.plan.cells] * 2)
    assert all(found is not None and found.alone for found in map(ready.store.outcome, ready.plan.cells))


def test_a_cluster_solves_nothing_again_on_this_machine() -> None:
    with pytest.raises(UserError, match=r"steady .* dask"):
        Settings(steady=True, dask="local")


def test_a_doubtful_cell_is_due_again_only_if_asked_for(tmp_path: Path) -> None:
    ready = comparison.prepare("flat", SCENE, plugin=METHODS, out=tmp_path / "run")
    ready.run()
    (cell,) = ready.plan.cells
    path = ready.store.cell(cell) / "cell.json"
    facts = json.loads(path.read_text())
    facts["outcome"]["doubt"] = "others took 1 processor seconds of 1 s"
    path.write_text(json.dumps(facts))
    assert not ready.pending().cells
    again = comparison.prepare("flat", SCENE, plugin=METHODS, out=tmp_path / "run", settings=Settings(steady=True))
    assert again.pending().cells == (cell,)
    ((_, why),) = explained(again.plan, again.store, again.settings)
    assert why == "its seconds are in doubt: others took 1 processor seconds of 1 s"


def test_processes_threads_and_marks(tmp_path: Path) -> None:
    names = [f"tells[mark={mark}]" for mark in range(4)]

    def look(folder: str, **settings: object) -> tuple[list[float], pd.DataFrame]:
        ready = comparison.prepare(
            names, SMALL, out=tmp_path / folder, plugin=[ROUGH, METHODS], settings=Settings(**settings)
        )
        ready.run()
        scene = next(iter(ready.scenes.values()))
        maps = [ready.store.disparity(cell)[scene.ref] for cell in ready.plan.cells]
        return [float(np.unique(one).item()) for one in maps], ready.tables().cells

    processes, cells = look("alone", threads=1)
    assert len(set(processes)) == 4, "one process a cell"
    assert cells.alone.all()
    assert (cells.threads == 1).all()
    log = (tmp_path / "alone" / "cells" / cells.cell[0] / "log.txt").read_text()
    assert log.startswith("threads 1 1 1 1 1 True"), log

    processes, cells = look("shared", isolation="shared", threads=2)
    assert len(set(processes)) == 1, "one process for all"
    log = (tmp_path / "shared" / "cells" / cells.cell[3] / "log.txt").read_text()
    assert log.split()[1:6:4] == ["2", "2"], log

    processes, cells = look("many", jobs=4)
    assert len(set(processes)) == 4
    assert not cells.alone.any(), "others ran meanwhile"
    assert (cells.threads == max(1, limits.cores() // 4)).all()


def _start(folder: Path, *more: str) -> subprocess.Popen[str]:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "breeds", "loops", "tells[wait=3600]", "-s", SMALL]
    line += ["--plugin", str(ROUGH), "--out", str(folder), "--jobs", "3", *more]
    pipe = subprocess.PIPE
    process = subprocess.Popen(line, stdout=pipe, stderr=subprocess.STDOUT, text=True, start_new_session=True)
    end = time.monotonic() + 120
    while len(list(folder.glob("cells/.*"))) != 2 or not list(folder.glob("cells/[0-9a-f]*")):
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < end, "it never happened"
        time.sleep(0.05)
    time.sleep(1)
    return process


def test_nothing_outlives_a_run(tmp_path: Path) -> None:
    process = _start(tmp_path / "run")
    children = psutil.Process(process.pid).children(recursive=True)
    assert len(children) >= 5, "a server, keepers, methods"
    process.kill()
    process.wait()
    assert not psutil.wait_procs(children, timeout=300)[1]
    end = time.monotonic() + 60
    while list((tmp_path / "run" / "cells").glob(".*")):
        assert time.monotonic() < end, "drafts are left"
        time.sleep(0.05)
