"""Processes that methods have left: those whose watcher was killed, so that it could not end them (Linux).

Two things are known of them. The fork server, from which all watchers come, adopts those below it whose parent has
ended (`matbench.solving.fork_server`). And each process shows the environment that the fork server was started with:
its `MARK` says which process started that.
"""

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import psutil

from matbench.solving import processes
from matbench.solving.processes import MARK, begin_of

_PATIENCE = 5.0  # seconds: a method may fork faster than it can be killed; it must not keep the harness here for ever


def end_left(watchers: set[int]) -> None:
    """End what killed watchers of this process have left.

    Parameters
    ----------
    watchers
        The numbers of those that live: what is below them is theirs.
    """
    server = processes.server()
    # the user may have started processes, too, also by the same server
    known = watchers.union(process.pid for process in multiprocessing.active_children() if process.pid)
    session, own = os.getsid(0), processes.own_mark()

    def left() -> list[psutil.Process]:
        marked = [process for process in _marked() if _mark(process.pid) == own]
        with suppress(psutil.Error):
            marked += psutil.Process(server).children() if server else []
        # whatever is below a watcher has left the session of this process for good
        return [one for one in marked if _session(one) not in (None, session) and known.isdisjoint(_line(one, server))]

    _end(left)


def end_of_the_dead() -> None:
    """End what was started by processes that have been killed: another run that was, say."""

    above = _line(psutil.Process())

    def left() -> list[psutil.Process]:
        return [process for process in _marked() if process.pid not in above and not _lives(_mark(process.pid))]

    _end(left)


def _end(left: Callable[[], list[psutil.Process]]) -> None:
    """End processes as long as there are any."""
    end = time.monotonic() + _PATIENCE
    while (found := left()) and time.monotonic() < end:
        for process in found:
            with suppress(psutil.Error):
                for below in process.children(recursive=True):
                    with suppress(psutil.Error):
                        below.kill()
                process.kill()
        psutil.wait_procs(found, timeout=0.1)


def _marked() -> Iterator[psutil.Process]:
    """Every process of this user that has a mark and sees the processes that this one sees."""
    for pid in psutil.pids():
        if pid != os.getpid() and _mark(pid) and _world(pid) == _world(os.getpid()):
            with suppress(psutil.Error):
                yield psutil.Process(pid)


def _mark(pid: int) -> str:
    with suppress(OSError):
        for entry in Path("/proc", str(pid), "environ").read_bytes().split(b"\0"):
            name, _, value = entry.partition(b"=")
            if name == MARK.encode():
                return value.decode("ascii", "replace")
    return ""


def _world(pid: int) -> str:
    """In which world of process numbers it lives: in a container, numbers mean other processes."""
    with suppress(OSError):
        return str(Path("/proc", str(pid), "ns", "pid").readlink())
    return ""


def _lives(mark: str) -> bool:
    pid, _, begin = mark.partition("-")
    return pid.isdecimal() and begin == begin_of(int(pid))


def _session(process: psutil.Process) -> int | None:
    with suppress(OSError):
        return os.getsid(process.pid)
    return None


def _line(process: psutil.Process, end: int | None = None) -> list[int]:
    """The numbers of a process and of those above it, as far as one that is left out."""
    line = [process.pid]
    with suppress(psutil.Error):
        line += [one.pid for one in process.parents()]
    return line[: line.index(end)] if end in line else line
