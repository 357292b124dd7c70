"""Processes that watch methods are watched themselves."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path

import psutil
import pytest
from waiting import wait_until

from matbench.errors import UserError
from matbench.solving import processes, watcher
from matbench.solving.environment import without_main
from matbench.solving.watcher import Watcher

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="watched by Linux's means")


def waits(line: Connection) -> None:
    """What a watcher does that has a process below itself, until its line ends."""
    processes.lead_own_session()
    below = os.fork()
    if not below:
        time.sleep(600)
    line.send(below)
    with pytest.raises(EOFError):
        line.recv()
    processes.kill_descendants()


@pytest.fixture
def started() -> Iterator[tuple[Watcher, Connection, psutil.Process, psutil.Process]]:
    """A watcher, its line, its process, and the one below it."""
    with without_main():
        processes.start_server([])
        line, theirs = Pipe()
        made = Watcher(waits, (theirs,))
        theirs.close()
    below = psutil.Process(line.recv())
    with line:
        yield made, line, below.parent(), below
    made.end(at_once=True)


def gone(*every: psutil.Process) -> bool:
    return not psutil.wait_procs(every, timeout=100)[1]


def test_one_that_is_told_ends_by_itself(started, monkeypatch: pytest.MonkeyPatch) -> None:
    made, line, process, below = started
    assert not made.is_stopped()
    monkeypatch.setattr(watcher, "_PATIENCE", 100.0)
    line.close()
    made.end()
    assert made._process.exitcode == 0, "it was not killed"
    assert gone(process, below)


def test_one_that_was_killed_leaves_nothing(started) -> None:
    made, _, process, below = started
    process.kill()
    made.end()
    assert gone(process, below)


def test_one_that_was_stopped_is_found_out_and_killed(started, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watcher, "_LOOK", 0.05)
    made, _, process, below = started
    process.suspend()
    wait_until(made.is_stopped)
    made.end(at_once=True)
    assert gone(process, below)


def test_one_that_goes_on_was_not_stopped(started, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watcher, "_LOOK", 0.05)
    made, _, process, _ = started
    process.suspend()
    time.sleep(0.06)
    assert not made.is_stopped(), "once is not enough"
    process.resume()
    for _ in range(10):
        time.sleep(0.06)
        assert not made.is_stopped()


def test_a_fork_server_that_was_stopped_goes_on_and_one_that_was_killed_is_started_again(started) -> None:
    server = processes.server()
    assert server is not None
    for number in (signal.SIGSTOP, signal.SIGKILL):
        os.kill(server, number)
        line, theirs = Pipe()
        with without_main():
            other = Watcher(waits, (theirs,))
        theirs.close()
        below = psutil.Process(line.recv())
        line.close()
        other.end()
        assert gone(below)
    assert processes.server() != server


def test_a_fork_server_that_does_not_answer_is_given_up(started, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watcher, "_START", 0.3)
    monkeypatch.setattr(watcher, "_TRIES", 1)
    monkeypatch.setattr(processes, "wake_server", lambda: None)
    server = processes.server()
    assert server is not None
    os.kill(server, signal.SIGSTOP)
    with pytest.raises(UserError, match="that they are forked from has ended"), without_main():
        Watcher(waits, Pipe())


START = """
import os, sys
from multiprocessing import get_context, set_executable
from matbench.errors import UserError
from matbench.solving import processes
from matbench.solving.watcher import Watcher

def started(word):
    try:
        processes.start_server([])
        watcher = Watcher(os.write, (1, f"{word}\\n".encode()))
    except UserError as error:
        return print(error, flush=True)
    watcher.end()

if __name__ == "__main__":
    if len(sys.argv) > 1:
        set_executable(sys.argv[1])
        started("own")
        raise SystemExit
    started("own")
    for how in ("fork", "spawn"):
        with get_context(how).Pool(1) as pool:  # of daemonic processes
            pool.map(started, [how])
"""


def test_processes_start_with_any_temporary_folder_and_in_daemonic_processes(tmp_path: Path) -> None:
    """The sockets of `multiprocessing` lie in the temporary folder, and the paths of sockets are short."""
    far = tmp_path / ("x" * 100) / ("y" * 100)
    far.mkdir(parents=True)
    (tmp_path / "start.py").write_text(START)
    environment = {**os.environ, "TMPDIR": str(far)}
    line = [sys.executable, str(tmp_path / "start.py")]
    done = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=300)
    assert (done.stdout.split(), done.stderr) == (["own", "fork", "spawn"], "")
    assert list(far.iterdir()) == []


def test_where_the_fork_server_is_killed_at_its_start_it_is_said_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "start.py").write_text(START)
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\ncase "$*" in *forkserver*) kill -9 $$;; esac\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    line = [sys.executable, str(tmp_path / "start.py"), str(python)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=300)
    said = "no process can be started for methods: the process that they are forked from has ended\n"
    assert (done.stdout, done.stderr) == (said, "")
