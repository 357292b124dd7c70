"""A run that is killed again and again ends as if nothing had been."""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import psutil
import pytest
from launcher import METHODS, SCENE, SEEDS
from places import LAUNCHER
from resuming import PATIENCE, PLUGIN, command, finished
from waiting import wait_until

from matbench import comparison


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[Path], int]]:
    """Start a run of 50 cells in a folder, when the one before has ended; the process that works on it."""
    (tmp_path / "plugin.py").write_text(PLUGIN)
    (tmp_path / "journal").touch()
    environment = {**os.environ, "JOURNAL": str(tmp_path / "journal")}
    line = [sys.executable, str(LAUNCHER), str(tmp_path / "plugin.py")]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as launcher:
        assert launcher.stdin is not None
        assert launcher.stdout is not None
        launched = 0

        def begin(folder: Path) -> int:
            nonlocal launched
            assert launched == 0 or launcher.stdout.readline() == "ended\n"  # type: ignore[union-attr]
            launched += 1
            print(folder, file=launcher.stdin, flush=True)
            return int(launcher.stdout.readline())  # type: ignore[union-attr]

        yield begin
        launcher.stdin.close()


KILLS = int(os.environ.get("MATBENCH_TESTS_KILLS", "10"))
"""Each takes some seconds: in CI few, by hand more."""


def test_killed_at_random_moments_it_ends_as_if_undisturbed(tmp_path: Path, start: Callable[[Path], int]) -> None:
    chance = random.Random(5)  # noqa: S311
    run, journal = tmp_path / "run", tmp_path / "journal"
    done: dict[str, tuple[int, int]] = {}
    pid, kills, whole = start(run), 0, 0
    while kills < KILLS:
        if not _works(pid):
            pid = start(run)
        before = journal.stat().st_size
        if chance.random() < 0.8:  # else while it starts, or between two cells
            wait_until(partial(_has_moved, journal, before, pid), PATIENCE, "a solve")
        time.sleep(chance.random() * 0.15)
        try:
            parent = psutil.Process(pid)
            children = parent.children(recursive=True)
        except psutil.NoSuchProcess:
            continue
        who = chance.choice(["all", "parent", "child", "child"])
        victims = [parent, *children] if who == "all" else [parent] if who == "parent" else children
        if who == "child" and victims:
            victims = [chance.choice(victims)]
        for victim in victims:
            _kill(victim)
        kills += bool(victims)
        if parent in victims:
            whole += 1
            wait_until(partial(_rests, pid), PATIENCE, "its end")
            assert not psutil.wait_procs(children, timeout=PATIENCE)[1], "what it started outlived it"
            now = finished(run)
            assert done.items() <= now.items(), "a finished cell was lost or computed again"
            done = now
    assert whole >= KILLS // 4
    assert len(done) < len(METHODS) * len(SEEDS), "the last kill came too late to matter"
    if _works(pid):
        _kill(psutil.Process(pid))
    wait_until(partial(_rests, pid), PATIENCE, "its end")

    done = finished(run)
    line = command(tmp_path / "plugin.py", run, "-a", *METHODS, "--seed", *map(str, SEEDS))
    last = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)
    assert last.returncode == 0, last.stdout + last.stderr
    now = finished(run)
    assert done.items() <= now.items()
    assert len(now) == 50
    assert not list((run / "cells").glob(".*"))
    assert {path.name for path in run.glob(".*")} == {".lock"}

    undisturbed = tmp_path / "undisturbed"
    wait_until(partial(_rests, start(undisturbed)), PATIENCE, "the undisturbed run")
    again = comparison.prepare(METHODS, SCENE, out=undisturbed, seed=SEEDS, plugin=tmp_path / "plugin.py")
    assert not again.pending().cells
    again.tables()
    assert (run / "results.csv").read_bytes() == (undisturbed / "results.csv").read_bytes()


def _works(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _rests(pid: int) -> bool:
    return not _works(pid)


def _has_moved(journal: Path, size: int, pid: int) -> bool:
    return journal.stat().st_size > size or _rests(pid)


def _kill(process: psutil.Process) -> None:
    with suppress(psutil.NoSuchProcess):
        process.send_signal(signal.SIGKILL)
