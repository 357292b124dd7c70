"""Processes: the memory that they use, the limits that they get, and how they are ended with all they started."""

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
# MiB added to the hard limit: threads reserve stacks and arenas that they never touch. The keeper ends
# a process that really holds more than its limit; this limit only stops allocations far beyond it.
_SLACK = 256
_DEATH_SIGNAL, _CHILD_SUBREAPER = 1, 36  # PR_SET_PDEATHSIG and PR_SET_CHILD_SUBREAPER of prctl(2)
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


def memory_used(pid: int, whole_tree: bool = True) -> float:
    """Resident memory, in MiB, of a process and, with `whole_tree`, of all its descendants.

    Memory that several of them share counts once. A process that has just ended has none.
    """
    try:
        process = psutil.Process(pid)
        tree = [process, *(process.children(recursive=True) if whole_tree else ())]
        if len(tree) == 1:  # by far the quickest to read; sharing matters only among several
            return float(process.memory_info().rss / _MIB)
        return sum(_proportional_size(one) for one in tree) / _MIB
    except psutil.Error:
        return 0.0


def _proportional_size(process: psutil.Process) -> int:
    """Bytes of a process, shared pages divided among those that share them (PSS); else its resident bytes."""
    with suppress(psutil.Error, AttributeError):
        return int(process.memory_full_info().pss)
    with suppress(psutil.Error):
        return int(process.memory_info().rss)
    return 0


def kills_for_memory() -> int:
    """How many processes Linux has killed since it booted because memory had run out; 0 where that is not known."""
    with suppress(OSError):
        for line in Path("/proc/vmstat").read_text().splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


def confine(memory: int) -> None:
    """Limit this process, and those that it starts, to `memory` MiB of further private memory.

    A runaway allocation then raises `MemoryError` where it happens, before it has taken anything. If
    the machine runs out of memory all the same, the system ends this process first. It leaves no core file.
    """
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a core file is as large as the memory, and nobody reads it
    with suppress(OSError, ValueError):
        # 1000 is the highest: the system chooses this process before the harness or anything else of the user's
        Path("/proc/self/oom_score_adj").write_text("1000")
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        # not RLIMIT_AS: that counts reserved addresses, of which numba, OpenCV and threads take many and use few.
        # The limit counts what the process has already inherited, so that is added.
        now = next(int(line.split()[1]) for line in lines if line.startswith("VmData:")) // 1024
        limit = (now + memory + _SLACK) * _MIB
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


def use_threads(count: int) -> None:
    """Have all numerical libraries use `count` threads: those loaded already, and those loaded later."""
    import cv2
    import threadpoolctl

    for name in _THREAD_VARIABLES:
        os.environ[name] = str(count)
    threadpoolctl.threadpool_limits(count)
    cv2.setNumThreads(count)
    if "numba" in sys.modules:
        import numba

        # numba has fixed its largest number of threads when it was imported, and refuses more
        numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    else:
        os.environ["NUMBA_NUM_THREADS"] = str(count)


def start_server(preload: Iterable[str]) -> None:
    """Start the fork server, the process that all keepers are forked from, unless it runs already.

    It imports the modules of `preload` once, and every forked process has them at once. A plain fork of
    this process would copy its threads' locks in whatever state they are, and may hang; a spawned process
    would import numba and OpenCV again for every cell, which takes seconds.
    """
    get_context("forkserver").set_forkserver_preload(list(preload))
    # Ctrl-C reaches the whole foreground group: it would end the server in the middle of its imports, with a
    # traceback. A new process inherits the blocked signal; keepers unblock it (`lead_own_session`).
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    warnings = os.environ.get("PYTHONWARNINGS")
    # its resource tracker warns of semaphores that killed processes have left: that is expected, and it removes them
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
    """Start a session of one's own, which Ctrl-C does not reach, and adopt orphaned descendants (Linux).

    A process whose parent has ended is adopted by the nearest subreaper above it instead of by init. So
    `kill_descendants` finds what a method has started even where the method detached it.
    """
    os.setsid()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])  # blocked by `start_server`
    _prctl(_CHILD_SUBREAPER, 1)


def die_with_parent(parent: int) -> None:
    """Have the system kill this process as soon as its parent, process `parent`, ends in any way (Linux)."""
    _prctl(_DEATH_SIGNAL, signal.SIGKILL)  # a method may ignore every other signal
    # the parent may have ended between the fork and the line above: then no signal will come
    if os.getppid() != parent:
        os._exit(1)


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def kill_descendants() -> None:
    """Kill all descendants of this process, those started meanwhile too, and wait until they are gone."""
    for _ in range(1000):  # a method may fork faster than one round kills; it must not keep the harness here for ever
        below = psutil.Process().children(recursive=True)
        for process in below:
            with suppress(psutil.Error):
                process.kill()
        reap()
        if not below:
            return
        with suppress(ChildProcessError):
            os.waitpid(-1, 0)  # sleep until one is gone instead of looking again and again


def reap() -> Mapping[int, int]:
    """Collect the children that have ended: process id -> wait status. Until then they stay as zombies."""
    ended = {}
    with suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0]:
            ended[found[0]] = found[1]
    return ended
