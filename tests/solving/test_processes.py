"""Processes: how they are ended with all they started."""

import os
import signal
import subprocess
import sys

import psutil
import pytest
from forking import in_child
from waiting import lives, wait_until

from matbench.solving import processes

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="done by Linux's calls")


def test_descendants_end_even_those_that_have_gone_their_own_way() -> None:
    def act() -> list[int]:
        processes.lead_own_session()
        assert os.getsid(0) == os.getpid()
        plain = subprocess.Popen(["sleep", "600"])
        # its parent ends at once: it is adopted by the process that leads
        line = ["sh", "-c", "trap '' TERM; setsid sleep 600 >/dev/null 2>&1 & echo $!"]
        orphan = int(subprocess.run(line, capture_output=True, text=True, check=True).stdout)
        wait_until(lambda: len(psutil.Process().children()) == 2)
        processes.kill_descendants()
        assert not psutil.Process().children()
        return [plain.pid, orphan]

    assert not [pid for pid in in_child(act) if lives(pid)]


def test_children_that_have_ended_are_collected() -> None:
    def act() -> list[object]:
        first = subprocess.Popen(["sh", "-c", "exit 3"])
        second = subprocess.Popen(["sleep", "600"])
        found: dict[int, int] = {}
        wait_until(lambda: found.update(processes.reap()) or found)
        assert list(found) == [first.pid]
        second.kill()
        wait_until(lambda: found.update(processes.reap()) or len(found) == 2)
        return [os.waitstatus_to_exitcode(found[pid]) for pid in (first.pid, second.pid)]

    assert in_child(act) == [3, -signal.SIGKILL]


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


def test_the_fork_server_is_born_with_ctrl_c_blocked() -> None:
    """In the middle of its imports it would end with a traceback. Python's own tracker, started with it, unblocks."""
    code = (
        "from multiprocessing import forkserver\n"
        "from matbench.solving.processes import start_server\n"
        "start_server([])\n"
        "print(open(f'/proc/{forkserver._forkserver._forkserver_pid}/status').read())\n"
        "print(open('/proc/self/status').read())\n"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True).stdout
    server, own = (
        int(line.split()[1], 16) >> (signal.SIGINT - 1) & 1 for line in said.splitlines() if "SigBlk" in line
    )
    assert (server, own) == (1, 0)


def test_a_threading_layer_that_is_not_there_costs_only_those_who_use_it() -> None:
    code = """
import numba
from matbench.solving import processes
processes.use_threads(1)
print(numba.njit(lambda x: 2 * x)(21))
try:
    numba.njit(lambda x: [x for _ in numba.prange(2)], parallel=True)(1)
except ValueError as error:
    print(error)
"""
    env = {**os.environ, "NUMBA_THREADING_LAYER": "nonsense"}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300)
    assert done.stdout.splitlines()[0] == "42", done.stderr
    assert "'nonsense'" in done.stdout.splitlines()[1], "numba says it itself"
