"""The folder of a run: its plan, its cells, and whatever is wrong with them."""

import errno
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve
from compared import SMALL, cells, scored
from launcher import SCENE
from places import METHODS
from refusing import refusing
from resuming import finished

from matbench import comparison
from matbench.errors import UserError
from matbench.files import plain
from matbench.plans.settings import Settings
from matbench.results.status import prune, standing
from matbench.runs.stopped import FolderLost
from matbench.runs.store import Store


def test_half_a_cell_is_no_cell(tmp_path: Path) -> None:
    scored(tmp_path, "flat")
    run = tmp_path / "run"
    (run / "cells" / cells(tmp_path).cell["flat"] / "cell.json").write_text('{"outcome": {"sta')
    scores = (run / "results.csv").read_bytes()
    scored(tmp_path, "flat")
    assert (run / "results.csv").read_bytes() == scores
    assert cells(tmp_path).status["flat"] == "ok"


@pytest.mark.parametrize("damage", ["missing", "junk", "pickled", "shape"])
def test_damaged_maps_are_computed_anew(tmp_path: Path, damage: str) -> None:
    scored(tmp_path, "flat")
    run = tmp_path / "run"
    scores = (run / "results.csv").read_bytes()
    maps = run / "cells" / cells(tmp_path).cell["flat"] / "disparity.npz"
    if damage == "missing":
        maps.unlink()
    elif damage == "junk":
        maps.write_bytes(b"nothing like a map")
    elif damage == "pickled":
        np.savez(maps, view_2=np.array([{"a": 1}], object))
    else:
        np.savez(maps, view_2=np.zeros(3, np.float32))
    scored(tmp_path, "flat")
    assert (run / "results.csv").read_bytes() == scores


def test_the_plan_on_disk_holds_no_code_and_reads_back(tmp_path: Path) -> None:
    ready = comparison.prepare(["flat"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    assert ready.store.plan() == ready.plan
    plan = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert plan["request"]["scenes"] == [SMALL]


@pytest.mark.parametrize("damage", ["[]", "{}", '{"request": 3}', "nonsense", '{"cells": [{"key": "../../x"}]}'])
def test_a_hostile_plan_is_refused(tmp_path: Path, damage: str) -> None:
    ready = comparison.prepare(["flat"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    (tmp_path / "run" / "plan.json").write_text(damage)
    with pytest.raises(UserError):
        ready.store.plan()


def test_recordings_are_written_on_request_and_found_by_name(tmp_path: Path) -> None:
    scored(tmp_path, "flat", "noise")
    store = Store(tmp_path / "run")
    with pytest.raises(UserError, match="has no recordings"):
        store.recording()
    scores = (tmp_path / "run" / "results.csv").read_bytes()
    scored(tmp_path, "flat", "noise", record=True)
    assert (tmp_path / "run" / "results.csv").read_bytes() == scores
    with pytest.raises(UserError, match="there are 2 recordings: name one of 'flat on"):
        store.recording()
    with pytest.raises(UserError, match="0 recordings match 'sgbm'"):
        store.recording("sgbm")
    found = store.recording("flat")
    assert found.name == "recording.rrd"
    assert store.recording(found.parent.name) == found
    before = found.stat().st_mtime_ns
    scored(tmp_path, "flat", "noise", record=True)
    assert found.stat().st_mtime_ns == before


def test_a_file_system_that_is_lost_is_not_taken_for_an_empty_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Simulated: the error that a lost server gives (ESTALE) is raised where files are read."""
    ready = comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=METHODS)
    ready.run()
    before = finished(tmp_path / "run")
    assert len(before) == 1

    def lost(*_: object, **__: object) -> str:
        raise OSError(116, "Stale file handle")

    with monkeypatch.context() as patch:
        patch.setattr(plain, "open_plain", lost)
        with pytest.raises(FolderLost, match="Stale file handle"):
            ready.pending()
    assert not ready.pending().cells
    assert finished(tmp_path / "run") == before
    shutil.move(tmp_path / "run" / "cells", tmp_path / "elsewhere")  # unmounted: it looks empty
    again = evolve(ready, settings=Settings(only="all"))
    started = []
    with pytest.raises(UserError):
        again.run(lambda event, *_: (started.append(event), shutil.rmtree(tmp_path / "run" / "cells")))
    assert started == ["start"]


def test_a_run_killed_before_its_plan_was_written_can_begin(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    for name in (".lock", ".plan.json.abc123", ".work.json.77"):
        (run / name).touch()
    ready = comparison.prepare("flat", SCENE, out=run, plugin=METHODS)
    assert ready.store.plan() == ready.plan
    ready.store.sweep()
    assert {path.name for path in run.iterdir()} == {".lock", "plan.json", "cells"}


def test_a_cell_cannot_lead_what_is_written_or_removed_elsewhere(tmp_path: Path) -> None:
    ready = comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=METHODS)
    home = tmp_path / "home"
    (home / ".0123456789abcdef.secret").mkdir(parents=True)
    (home / ".removed.things").mkdir()
    before = sorted(home.rglob("*"))
    cells = tmp_path / "run" / "cells"
    cells.rmdir()
    cells.symlink_to(home)
    for attempt in (
        lambda: ready.run(),
        lambda: comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=METHODS),
        lambda: prune(tmp_path / "run"),
    ):
        with pytest.raises(UserError, match="is a link"):
            attempt()
    assert sorted(home.rglob("*")) == before
    cells.unlink()
    cells.mkdir()
    key = ready.plan.cells[0].key
    (cells / key).symlink_to(home)
    ready.run()
    assert sorted(home.rglob("*")) == before
    assert not (cells / key).is_symlink()
    assert len(finished(tmp_path / "run")) == 1
    (tmp_path / "run" / ".lock").unlink()
    (tmp_path / "run" / ".lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UserError, match="cannot be locked"):
        ready.run()
    assert not (tmp_path / "elsewhere").exists()


def test_names_with_separators_stay_inside(tmp_path: Path) -> None:
    plugin = tmp_path / "odd.py"
    plugin.write_text(METHODS.read_text() + "\n\nclass Odd(Flat):\n    name = '../../odd'\n")
    with pytest.raises(UserError, match="may hold letters, digits"):
        comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=plugin)
    ready = comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=METHODS)
    facts = json.loads((tmp_path / "run" / "plan.json").read_text())
    for change in (
        {"key": "../../../evil/key"},
        {"key": "0123456789ABCDEF"},
        {"scene": "synthetic/box\x1b[2J"},
        {"scene": "a" * 5000},
    ):
        (tmp_path / "run" / "plan.json").write_text(json.dumps({**facts, "cells": [{**facts["cells"][0], **change}]}))
        with pytest.raises(UserError, match="is damaged"):
            standing(tmp_path / "run")
    (tmp_path / "run" / "plan.json").write_text(json.dumps(facts))
    place = ready.store.cell(ready.plan.cells[0])
    place.mkdir()
    (place / "cell.json").write_text('{"outcome": {"status": "ok"}}')
    spelled = '{"outcome": {"status": "failed", "reason": "one\\u001b[2J\\ntwo", "seconds": %s}}'
    (place / "cell.json").write_text(spelled % "1e999")
    assert ready.store.read(ready.plan.cells[0]).outcome is None
    (place / "cell.json").write_text(spelled % "1")
    told = ready.store.outcome(ready.plan.cells[0])
    assert told is not None
    assert told.reason == "one two"
    (place / "cell.json").write_text('{"outcome": {"status": "ok"}}')
    marker = tmp_path / "executed"
    np.savez(place / "disparity.npz", view_2=np.array([_Malice(str(marker))], object))
    assert ready.store.read(ready.plan.cells[0]).outcome is None
    np.savez(place / "volume.npz", levels=np.array([_Malice(str(marker))], object), space=np.zeros(3), views=[0, 1])
    assert ready.store.volume(ready.plan.cells[0]) is None
    assert not marker.exists()


class _Malice:
    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (self.path,)


TRY = "import sys; from pathlib import Path; from matbench.runs.store import Store; Store(Path(sys.argv[1])).try_out()"


def test_a_file_system_that_does_not_tell_when_files_are_on_the_disk_is_not_taken_for_a_full_one(
    tmp_path: Path,
) -> None:
    (tmp_path / "run" / "cells").mkdir(parents=True)
    line = [sys.executable, "-c", TRY, str(tmp_path / "run")]
    for number, is_lost in ((errno.EINVAL, False), (errno.ENOSPC, True)):
        environment = refusing(tmp_path, tmp_path / "run", {"fsync": number})
        done = subprocess.run(line, env=environment, capture_output=True, text=True)
        assert bool(done.returncode) == is_lost, done.stderr
        assert ("FolderLost" in done.stderr) == is_lost


def test_a_plan_of_a_hundred_thousand_faults_is_refused_at_the_first(tmp_path: Path) -> None:
    ready = comparison.prepare(["flat"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    path = tmp_path / "run" / "plan.json"
    plan = json.loads(path.read_text())
    plan["cells"] = [{"key": "0" * 16}] * 100_000
    path.write_text(json.dumps(plan))
    began = time.process_time()
    with pytest.raises(UserError, match="is not a plan"):
        Store(ready.store.folder).plan()
    assert time.process_time() - began < 2, "a note for each of them takes ten seconds"
