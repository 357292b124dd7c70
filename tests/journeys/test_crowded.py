"""Runs that are crowded and starved, and go on as if nothing had been."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from launcher import SCENE
from places import METHODS as BEHAVED
from resuming import PATIENCE, PLUGIN, command
from waiting import wait_until

from matbench import comparison
from matbench.cli import main
from matbench.errors import UserError
from matbench.rescoring import open_run
from matbench.results import scores
from matbench.results.status import prune, standing
from matbench.runs.lock import locked


def test_a_second_process_is_refused_and_the_first_can_be_watched(tmp_path: Path) -> None:
    run, plugin = tmp_path / "run", tmp_path / "plugin.py"
    endless = "        while scene.height > 16 and context.seed:\n            time.sleep(1)\n        values ="
    plugin.write_text("import time\n" + PLUGIN.replace("        values =", endless))
    line = command(plugin, run, "-a", "seeded", "--seed", "0", "1")
    first = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        wait_until(lambda: any((run / "cells").glob("[0-9a-f]*")), PATIENCE, "the first cell")
        second = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)
        assert second.returncode == 2
        assert second.stderr.count("\n") == 1
        assert f"is in use by process {first.pid} on " in second.stderr
        with pytest.raises(UserError, match="is in use by process"):
            prune(run)
        with pytest.raises(UserError, match="is in use by process"):
            open_run(run)[0].tables()
        wait_until(lambda: standing(run).running, PATIENCE, "the endless cell")
        found = standing(run)
        assert found.work is not None
        assert (found.work.pid, found.counts, found.left) == (first.pid, {"ok": 1}, 1)
        assert [str(cell) for cell, _ in found.running] == [f"seeded on {SCENE}, seed 1"]
        assert found.seconds_left is not None
    finally:
        os.killpg(first.pid, signal.SIGKILL)
        first.wait()
    found = standing(run)
    assert (found.work, found.left, list(found.running)) == (None, 1, [])
    with locked(run):
        pass
    said = subprocess.run(
        [sys.executable, "-m", "matbench", "status", str(run), "--json"], capture_output=True, text=True, check=True
    ).stdout
    told = json.loads(said)
    assert (told["cells"], told["done"], told["left"], told["process"]) == (2, 1, 1, None)


COMPILED = """
import numba
import numpy as np
from matbench import Estimate

@numba.njit(cache=True)
def added(values, more):
    for row in range(values.shape[0]):
        for column in range(values.shape[1]):
            values[row, column] += more * column
    return values

class Compiled:
    def solve(self, scene, context):
        return Estimate({scene.ref: added(np.ones(scene.views.shape[1:3], np.float32), np.float32(0.125))})
"""

RUN = """
import sys
from matbench import comparison
ready = comparison.prepare("compiled", sys.argv[1], out=sys.argv[2], seed=range(3), plugin=sys.argv[3], command="")
print("ready", flush=True)
sys.stdin.readline()
ready.run()
print(*(ready.store.outcome(cell).maps for cell in ready.plan.cells))
"""


def test_two_runs_that_compile_into_one_empty_cache_at_once_get_the_same_maps(tmp_path: Path) -> None:
    plugin, cache = tmp_path / "compiled.py", tmp_path / "cache"
    plugin.write_text(COMPILED)
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    lines = [[sys.executable, "-c", RUN, SCENE, str(tmp_path / name), str(plugin)] for name in ("one", "two")]
    both = [subprocess.Popen(line, env=environment, text=True, **pipes) for line in lines]
    for one in both:
        assert one.stdout is not None
        assert one.stdout.readline() == "ready\n"
    for one in both:
        assert one.stdin is not None
        one.stdin.write("\n")
        one.stdin.flush()
    told = [one.communicate(timeout=PATIENCE)[0].split() for one in both]
    assert len({*told[0], *told[1]}) == 1, told
    assert [len(maps) for maps in told] == [3, 3]
    assert len(list(cache.rglob("*added*.nbi"))) == 1, "one cache"


_DISK = """
mount -t tmpfs -o size=300k none "$1" || exit 77
"$2" -c 'open("'"$1"'/large", "wb").write(bytes(200000))'
shift_out="$1"; python="$2"; shift 2
"$python" "$@" ; echo "status $?"
rm "$shift_out/large"
mount -o remount,size=30m "$shift_out"
"$python" "$@" ; echo "status $?"
cp "$shift_out/run/results.csv" "$OUT"
ls -A "$shift_out/run/cells" | grep '^\\.' && echo "drafts are left"
exit 0
"""


def test_a_full_disk_stops_the_run_and_the_same_command_ends_it(tmp_path: Path) -> None:
    """A real file system of 300 KB, in a name space of its own; 200 KB of it are taken at first."""
    if shutil.which("unshare") is None:
        pytest.skip("no unshare: a small file system cannot be mounted here")
    disk = tmp_path / "disk"
    disk.mkdir()
    line = command(BEHAVED, disk / "run", "-a", "flat", "noise", "flat[value=2]", "-s", "synthetic/box[size=240x180]")
    shell = ["unshare", "-rm", "sh", "-c", _DISK, "sh", str(disk), *line]
    environment = {**os.environ, "OUT": str(tmp_path)}
    told = subprocess.run(shell, capture_output=True, text=True, timeout=2 * PATIENCE, env=environment)
    if told.returncode in (1, 77) and "status" not in told.stdout:
        pytest.skip(f"a small file system cannot be mounted here: {told.stderr}")
    first, second = told.stdout.split("status ")[0], told.stdout.split("status ")[1]
    assert "stopped: run folder" not in first, "not where the tables are"
    assert told.stderr.count("stopped: run folder") == 1, told.stdout + told.stderr
    assert "No space left on device" in told.stderr
    assert "Traceback" not in told.stdout + told.stderr
    assert second.startswith("1\n")
    assert "status 0" in told.stdout
    assert "drafts are left" not in told.stdout
    names, scene = ["flat", "noise", "flat[value=2]"], "synthetic/box[size=240x180]"
    whole = comparison.prepare(names, scene, out=tmp_path / "whole", plugin=BEHAVED)
    whole.run()
    assert len(whole.tables().results)
    assert (tmp_path / "results.csv").read_bytes() == (tmp_path / "whole" / "results.csv").read_bytes()


def test_told_to_end_while_it_scores_it_writes_its_tables_first_and_the_next_one_clears_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    line = ["compare", "-a", "flat", "-s", SCENE, "--plugin", str(BEHAVED), "--out", str(run), "--json"]

    def ended() -> int:
        with pytest.raises(SystemExit) as stop:
            main(line)
        return int(stop.value.code or 0)

    made = scores.tables

    def disturbed(*given: Any) -> Any:
        os.kill(os.getpid(), signal.SIGTERM)
        return made(*given)

    with monkeypatch.context() as patch:
        patch.setattr(scores, "tables", disturbed)
        assert ended() == 0
    assert (run / "results.csv").stat().st_size > 0
    capsys.readouterr()
    (run / ".results.csv.abc123").touch()  # as `kill -9` leaves it
    assert ended() == 0
    assert {path.name for path in run.glob(".*")} == {".lock"}
