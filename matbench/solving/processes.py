"""Processes: how they are started, what they use, and how they are ended with all they started."""

import multiprocessing
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing import current_process, forkserver, get_context, resource_tracker, util
from pathlib import Path
from typing import Any

import psutil

from matbench import linux
from matbench.solving.environment import variables

MARK = "MATBENCH_STARTED_BY"
"""In the environment of the fork server, and so of all that comes from it: which process has started it."""
_PATIENCE = 10.0  # seconds for killed processes to be gone
_PAUSES = 0.0005, 0.001, 0.002, 0.004, 0.008, 0.016  # seconds between two looks at whether one has gone
_LONGEST = 75  # bytes of a folder's path: those of sockets, which lie in a folder below it, have 108 at most
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

        # it fails where the user's NUMBA_THREADING_LAYER cannot be loaded: then only kernels with numba's own threads
        # fail, and numba says why
        with suppress(ValueError):
            # numba has fixed its largest number of threads when it was imported, and refuses more
            numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    else:
        os.environ["NUMBA_NUM_THREADS"] = str(count)
    threadpoolctl.threadpool_limits(count)  # last, as numba has just loaded OpenMP with all the threads it knows of


@contextmanager
def no_daemon() -> Iterator[None]:
    """Take the mark of a daemon off this process for a moment.

    `multiprocessing` lets daemonic processes, such as the workers of Dask and of a `Pool`, start no children, as
    these could outlive them. Those of the harness cannot: they end with their line.
    """
    config = current_process()._config  # type: ignore[attr-defined]
    before = config.get("daemon")
    config["daemon"] = False
    try:
        yield
    finally:
        config["daemon"] = before


@contextmanager
def _short_temporary_folder() -> Iterator[None]:
    """Have `multiprocessing` put its sockets where their paths are short enough, whatever TMPDIR says."""
    before, usual = tempfile.tempdir, tempfile.gettempdir()
    if len(os.fsencode(usual)) > _LONGEST:
        others = (os.environ.get("XDG_RUNTIME_DIR", ""), "/tmp", "/var/tmp", "/dev/shm")  # noqa: S108 -- only to look
        short = (one for one in others if 0 < len(os.fsencode(one)) <= _LONGEST)
        tempfile.tempdir = next((one for one in short if os.access(one, os.W_OK | os.X_OK)), usual)
    try:
        util.get_temp_dir()  # it keeps to what it has made
        yield
    finally:
        tempfile.tempdir = before


def start_server(preload: Iterable[str]) -> None:
    """Start the fork server, the process that all keepers are forked from, unless it runs already.

    It imports the modules of `preload` once, and every forked process has them at once. A plain fork of
    this process would copy its threads' locks in whatever state they are, and may hang; a spawned process
    would import numba and OpenCV again for every cell, which takes seconds.
    """
    get_context("forkserver").set_forkserver_preload(["matbench.solving.fork_server", *preload])
    with suppress(OSError, EOFError):  # whoever forks from it tries again, and says why it cannot
        ensure_server()


def ensure_server() -> None:
    """Start the fork server again if it has ended: `multiprocessing` would do so, too, but otherwise."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    # its resource tracker warns of semaphores that killed processes have left: that is expected, and it removes them;
    # the server warns of the orphans that it has adopted
    ignored = ["ignore:resource_tracker:UserWarning", "ignore:forkserver:UserWarning"]
    warnings = ",".join(filter(None, [os.environ.get("PYTHONWARNINGS"), *ignored]))
    try:
        with variables({"PYTHONWARNINGS": warnings, MARK: own_mark()}), _short_temporary_folder():
            resource_tracker.ensure_running()  # first: the server starts it, too, and Python then unblocks SIGINT
            # Ctrl-C reaches the whole foreground group: it would end the server in the middle of its imports, with a
            # traceback. A new process inherits the blocked signal; keepers unblock it (`lead_own_session`).
            signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
            try:
                forkserver.ensure_running()
            except ChildProcessError:
                # this process was forked from one that has a server, as those of a `Pool` are, and needs its own
                found: Any = forkserver._forkserver
                preload = found._preload_modules
                found.__init__()
                forkserver.set_forkserver_preload(preload)
                forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def server() -> int | None:
    """The number of the fork server; None if this process has started none."""
    found: Any = forkserver._forkserver
    return found._forkserver_pid if isinstance(found._forkserver_pid, int) else None


def wake_server() -> None:
    """Have the fork server go on: a method may have stopped it, and whoever needs it would wait for ever."""
    _signal_server(signal.SIGCONT)


def kill_server() -> None:
    """Kill the fork server; the next `start_server` starts another."""
    _signal_server(signal.SIGKILL)


def _signal_server(number: signal.Signals) -> None:
    pid = server()
    if pid is not None:
        with suppress(OSError):
            os.kill(pid, number)  # a child that nobody has waited for: its number is no other process's


def own_mark() -> str:
    """The mark of what this process starts: its number, and when it was started, as numbers are used again."""
    return f"{os.getpid()}-{begin_of(os.getpid())}"


def begin_of(pid: int) -> str:
    """When a process was started, in the system's ticks (Linux); empty if there is none, or it has ended."""
    with suppress(OSError, IndexError):
        # the name, in brackets, may hold anything
        state, *words = Path("/proc", str(pid), "stat").read_bytes().rpartition(b")")[2].split()
        return "" if state in (b"Z", b"X") else words[18].decode()
    return ""


def lead_own_session() -> None:
    """Start a session of one's own, which Ctrl-C does not reach, and adopt orphaned descendants (Linux).

    So `kill_descendants` finds what a method has started even where the method detached it.
    """
    os.setsid()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])  # blocked by `start_server`
    linux.adopt_orphans()
    _begin_anew()


def _begin_anew() -> None:
    """Have `multiprocessing` do in this process, and below it, what it does in a program that has just begun.

    A process that comes from a fork server would use that server, too: what a method then starts would be no
    descendant of its keeper, which counts, confines and ends descendants only.
    """
    server: Any = forkserver._forkserver
    if server._forkserver_alive_fd is not None:  # the server ends when nobody holds this any more
        os.close(server._forkserver_alive_fd)
    server.__init__()
    multiprocessing.set_start_method(None, force=True)
    multiprocessing.process._parent_process = None  # type: ignore[attr-defined]
    multiprocessing.current_process().name = "MainProcess"


def kill_descendants() -> None:
    """Kill all descendants of this process, those started meanwhile too, and wait until they are gone.

    After `_PATIENCE` seconds it is given up: a process may wait for a disk that does not answer, or start others faster
    than they can be killed.
    """
    end = time.monotonic() + _PATIENCE
    while below := psutil.Process().children(recursive=True):
        for process in below:
            with suppress(psutil.Error):
                process.kill()
        if time.monotonic() > end:
            return
        for pause in _PAUSES:  # looking for descendants takes long: not again and again while none has gone
            if reap():
                break
            time.sleep(pause)
    reap()


def reap() -> Mapping[int, int]:
    """Collect the children that have ended: process id -> wait status. Until then they stay as zombies."""
    ended = {}
    with suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0]:
            ended[found[0]] = found[1]
    return ended
