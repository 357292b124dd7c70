"""Who works on a run."""

import errno
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from refusing import refusing

from matbench.errors import UserError
from matbench.runs.lock import LOCK, WORK, Work, is_locked, locked


def test_what_lies_about_who_works_is_not_believed(tmp_path: Path) -> None:
    facts = {"pid": 1, "host": "here", "since": 1.0, "running": {"0123456789abcdef": 2.0}}
    (tmp_path / ".work.json").write_text(json.dumps(facts))
    assert Work.read(tmp_path) is not None
    for lie in ({"host": "\x1b[2J"}, {"since": float("inf")}, {"running": {"0": float("nan")}}, {"pid": "x"}):
        (tmp_path / ".work.json").write_text(json.dumps({**facts, **lie}))
        assert Work.read(tmp_path) is None


HOLD = """
import sys
from pathlib import Path
from matbench.errors import UserError
from matbench.runs.lock import locked
try:
    for _ in range(2):
        with locked(Path(sys.argv[1])):
            print("in", flush=True)
            sys.stdin.readline()
except UserError as error:
    print(error, flush=True)
"""


ASK = """
import sys
from pathlib import Path
from matbench.runs.lock import is_locked
print(is_locked(Path(sys.argv[1])))
"""


def holding(run: Path, env: dict[str, str] | None = None) -> "subprocess.Popen[str]":
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(run)], text=True, env=env, **pipes)
    assert process.stdout is not None
    assert process.stdout.readline() == "in\n"
    return process


def test_deleting_the_lock_of_a_live_run_lets_nobody_in(tmp_path: Path) -> None:
    first = holding(tmp_path)
    try:
        for name in (LOCK, WORK):
            (tmp_path / name).unlink()
        assert is_locked(tmp_path)
        with pytest.raises(UserError, match="is in use by another process"), locked(tmp_path):
            pass
    finally:
        first.kill()
        first.communicate()
    assert not is_locked(tmp_path)
    with locked(tmp_path) as work:
        assert work.pid == os.getpid()


def test_where_nothing_can_be_locked_work_goes_on_and_one_process_is_let_in(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    unlocked = refusing(tmp_path, run, {"flock": errno.ENOLCK})
    first = holding(run, unlocked)
    second, asks = (
        subprocess.run([sys.executable, "-c", what, str(run)], env=unlocked, capture_output=True, text=True).stdout
        for what in (HOLD, ASK)
    )
    assert f"is in use by process {first.pid} on" in second
    assert asks == "True\n", "by what it says of itself"
    said, remarks = first.communicate("\n\n")
    assert said == "in\n", "again"
    assert remarks.count("nothing can be locked in") == 1
    assert not is_locked(run)


def test_who_has_ended_or_only_has_the_number_of_who_did_is_not_alive(tmp_path: Path) -> None:
    assert Work(tmp_path).is_alive
    assert not Work(tmp_path, since=time.time() - 1e6).is_alive, "this process was started later"
    assert not Work(tmp_path, host="elsewhere").is_alive
    ended = subprocess.Popen([sys.executable, "-c", ""], stdin=subprocess.DEVNULL)
    end = time.monotonic() + 60
    while Work(tmp_path, pid=ended.pid).is_alive and time.monotonic() < end:
        time.sleep(0.01)
    assert not Work(tmp_path, pid=ended.pid).is_alive, "a zombie"
    ended.wait()
    for number in (ended.pid, -1, 10**30):
        assert not Work(tmp_path, pid=number).is_alive
