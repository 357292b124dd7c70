"""Processes: how they are ended with all they started."""

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import psutil
import pytest
from forking import in_child

from matbench.solving import processes

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="done by Linux's calls")


def until(happens: Callable[[], object], seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not happens():
        assert time.monotonic() < end, "it never happened"
        time.sleep(0.02)


def lives(pid: int) -> bool:
    return psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE


def test_descendants_end_even_those_that_have_gone_their_own_way() -> None:
    def act() -> list[int]:
        processes.lead_own_session()
        assert os.getsid(0) == os.getpid()
        plain = subprocess.Popen(["sleep", "600"])
        # its parent ends at once: it is adopted by the process that leads
        line = ["sh", "-c", "trap '' TERM; setsid sleep 600 >/dev/null 2>&1 & echo $!"]
        orphan = int(subprocess.run(line, capture_output=True, text=True, check=True).stdout)
        until(lambda: len(psutil.Process().children()) == 2)
        processes.kill_descendants()
        assert not psutil.Process().children()
        return [plain.pid, orphan]

    assert not [pid for pid in in_child(act) if lives(pid)]


def test_a_process_dies_with_its_parent() -> None:
    def act() -> int:
        parent = os.getpid()
        if pid := os.fork():
            return pid  # and this parent ends
        os.close(1)  # nobody waits for what it inherits
        os.closerange(3, 64)
        processes.die_with_parent(parent)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(600)
        os._exit(0)

    pid = in_child(act)
    until(lambda: not lives(pid))


def test_who_comes_too_late_dies_at_once() -> None:
    pid = os.fork()
    if not pid:
        processes.die_with_parent(1)  # its parent is another one
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 1


def test_children_that_have_ended_are_collected() -> None:
    def act() -> list[object]:
        first = subprocess.Popen(["sh", "-c", "exit 3"])
        second = subprocess.Popen(["sleep", "600"])
        found: dict[int, int] = {}
        until(lambda: found.update(processes.reap()) or found)
        assert list(found) == [first.pid]
        second.kill()
        until(lambda: found.update(processes.reap()) or len(found) == 2)
        return [os.waitstatus_to_exitcode(found[pid]) for pid in (first.pid, second.pid)]

    assert in_child(act) == [3, -signal.SIGKILL]


def test_memory_is_kept_private() -> None:
    def dumpable() -> int:
        return int(ctypes.CDLL(None).prctl(3, 0, 0, 0, 0))  # PR_GET_DUMPABLE

    def act() -> list[int]:
        before = dumpable()
        processes.keep_private()
        return [before, dumpable()]

    assert in_child(act) == [1, 0]


@pytest.mark.parametrize("is_loaded", [True, False])
def test_libraries_use_the_threads_that_they_are_given(is_loaded: bool) -> None:
    """In a fresh process: a copy of this one has none of the threads that its libraries wait for."""
    code = f"""
import sys
if {is_loaded}:
    import numpy, numba
from matbench.solving import processes
processes.use_threads(1)
import cv2, numba, numpy, os
from threadpoolctl import threadpool_info
print(cv2.getNumThreads(), os.environ["OMP_NUM_THREADS"], numba.get_num_threads())
print(*{{pool["num_threads"] for pool in threadpool_info()}})
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.split() == ["1", "1", "1", "1"]
