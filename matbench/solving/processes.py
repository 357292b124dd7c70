"""Processes: how they are started, what they use, and how they are ended with all they started."""

import ctypes
import os
import signal
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from multiprocessing import forkserver, get_context

import psutil

# PR_SET_PDEATHSIG, PR_SET_DUMPABLE and PR_SET_CHILD_SUBREAPER of prctl(2)
_DEATH_SIGNAL, _DUMPABLE, _CHILD_SUBREAPER = 1, 4, 36
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


def use_threads(count: int) -> None:
    """Have all numerical libraries use `count` threads: those loaded already, and those loaded later."""
    import cv2
    import threadpoolctl

    for name in _THREAD_VARIABLES:
        os.environ[name] = str(count)
    cv2.setNumThreads(count)
    if "numba" in sys.modules:
        import numba

        # numba has fixed its largest number of threads when it was imported, and refuses more
        numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    else:
        os.environ["NUMBA_NUM_THREADS"] = str(count)
    threadpoolctl.threadpool_limits(count)  # last, as numba has just loaded OpenMP with all the threads it knows of


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


def keep_private() -> None:
    """Have the system refuse other processes of the same user a look into the memory of this one (Linux)."""
    _prctl(_DUMPABLE, 0)


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
