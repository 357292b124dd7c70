"""Runs that are crowded and starved, and go on as if nothing had been."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from launcher import SCENE
from places import METHODS as BEHAVED
from resuming import PATIENCE, PLUGIN, command, wait_until

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
        wait_until(lambda: any((run / "cells").glob("[0-9a-f]*")), "the first cell")
        second = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)
        assert second.returncode == 2
        assert second.stderr.count("\n") == 1
        assert f"is in use by process {first.pid} on " in second.stderr
        with pytest.raises(UserError, match="is in use by process"):
            prune(run)
        with pytest.raises(UserError, match="is in use by process"):
            open_run(run)[0].tables()
        wait_until(lambda: standing(run).running, "the endless cell")
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


def test_told_to_end_while_it_scores_it_ends_and_the_next_one_clears_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    line = ["compare", "-a", "flat", "-s", SCENE, "--plugin", str(BEHAVED), "--out", str(run), "--json"]

    def ended() -> int:
        with pytest.raises(SystemExit) as stop:
            main(line)
        return int(stop.value.code or 0)

    with monkeypatch.context() as patch:
        patch.setattr(scores, "tables", lambda *_: os.kill(os.getpid(), signal.SIGTERM))
        assert ended() == 130
    told = capsys.readouterr()
    assert (told.out, told.err.splitlines()[-1]) == ("", "matbench: interrupted")
    (run / ".results.csv.abc123").touch()  # as `kill -9` leaves it
    assert ended() == 0
    assert {path.name for path in run.glob(".*")} == {".lock"}
