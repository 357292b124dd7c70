"""Processes and what they may take, as the system measures and enforces it."""

import ctypes
import os
import resource
import signal
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from multiprocessing import forkserver, get_context
from pathlib import Path

import psutil

_MIB = 1 << 20
_SLACK = 256  # MiB beyond the limit, for stacks and arenas of threads
_DEATH_SIGNAL, _CHILD_SUBREAPER = 1, 36  # prctl(2)
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


def memory_used(pid: int, whole_tree: bool = True) -> float:
    """MiB of resident memory of a process and all below it; what they share counts once.

    A process that has just ended has none.
    """
    try:
        process = psutil.Process(pid)
        tree = [process, *(process.children(recursive=True) if whole_tree else ())]
        if len(tree) == 1:
            return float(process.memory_info().rss / _MIB)
        return sum(_proportional_size(one) for one in tree) / _MIB
    except psutil.Error:
        return 0.0


def _proportional_size(process: psutil.Process) -> int:
    with suppress(psutil.Error, AttributeError):
        return int(process.memory_full_info().pss)
    with suppress(psutil.Error):
        return int(process.memory_info().rss)
    return 0


def kills_for_memory() -> int:
    """How often the system has ended a process since it was started, because memory had run out (Linux)."""
    with suppress(OSError):
        for line in Path("/proc/vmstat").read_text().splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


def confine(memory: int) -> None:
    """Refuse this process, and those that it starts, more private memory than `memory` MiB from now on.

    A runaway allocation is then a `MemoryError` where it happens, before it has taken anything. If
    the machine runs out of memory all the same, the system ends this process first. It leaves no core file.
    """
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with suppress(OSError, ValueError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        now = next(int(line.split()[1]) for line in lines if line.startswith("VmData:")) // 1024
        limit = (now + memory + _SLACK) * _MIB
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


def use_threads(count: int) -> None:
    """Have the libraries that share out work use that many threads: those loaded, and those loaded later."""
    import cv2
    import threadpoolctl

    for name in _THREAD_VARIABLES:
        os.environ[name] = str(count)
    threadpoolctl.threadpool_limits(count)
    cv2.setNumThreads(count)
    if "numba" in sys.modules:
        import numba

        numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    else:
        os.environ["NUMBA_NUM_THREADS"] = str(count)


def start_server(preload: Iterable[str]) -> None:
    """Start the server that processes are forked from, unless it runs already.

    It is not interrupted by Ctrl-C while it imports what is to be there in all of them.
    """
    get_context("forkserver").set_forkserver_preload(list(preload))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    warnings = os.environ.get("PYTHONWARNINGS")
    # it clears away the semaphores of processes that were ended, and need not tell people
    os.environ["PYTHONWARNINGS"] = ",".join(filter(None, [warnings, "ignore:resource_tracker:UserWarning"]))
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if warnings is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = warnings


def lead_own_session() -> None:
    """Lead a session, which Ctrl-C does not reach, and adopt what the processes below leave behind (Linux)."""
    os.setsid()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])  # `start_server` has it blocked
    _prctl(_CHILD_SUBREAPER, 1)


def die_with_parent(parent: int) -> None:
    """Have the system end this process when its parent, process `parent`, ends, however it does (Linux)."""
    _prctl(_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def kill_descendants() -> None:
    """Kill every process below this one, and those that they start meanwhile, and wait until they are gone."""
    for _ in range(1000):
        below = psutil.Process().children(recursive=True)
        for process in below:
            with suppress(psutil.Error):
                process.kill()
        reap()
        if not below:
            return
        with suppress(ChildProcessError):
            os.waitpid(-1, 0)


def reap() -> Mapping[int, int]:
    """Processes below this one that have ended -> their wait status."""
    ended = {}
    with suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0]:
            ended[found[0]] = found[1]
    return ended
