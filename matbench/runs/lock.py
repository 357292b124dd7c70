"""The lock of a run folder: one process works on it at a time, and others can see which one, and on what."""

import json
import os
import platform
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import get_ident

from attrs import define, field

from matbench.errors import UserError, cause
from matbench.files.documents import read_json
from matbench.files.locking import Busy, held, is_held
from matbench.files.remarks import remark_once
from matbench.files.writing import move
from matbench.safe_text import hidden_in

LOCK, WORK = ".lock", ".work.json"
"""Two files in a run folder. The first is locked, and so is the folder itself: its lock stays whatever is deleted in
it, but NFS has none for folders. The second says who holds the locks, for people to read."""

_MOST_BYTES, _LATEST = 1 << 20, 1e11  # of `WORK`; seconds since 1970, in some thousand years
_PATIENCE = 2.0  # seconds to wait: another process that only asks `is_locked` holds the lock for a moment, too
_STARTED = 1.0  # seconds by which clocks and the time at which a process was started may differ


@define
class Work:
    """What the process that holds the lock is doing.

    Parameters
    ----------
    since
        Seconds since 1970 when it took the lock.
    running
        Key of each cell under way -> when it started, in seconds since 1970.
    """

    folder: Path
    pid: int = field(factory=os.getpid)
    host: str = field(factory=platform.node)
    since: float = field(factory=time.time)
    running: dict[str, float] = field(factory=dict)

    def start(self, key: str) -> None:
        self.running[key] = time.time()
        self.tell()

    def end(self, key: str) -> None:
        self.running.pop(key, None)
        self.tell()

    def tell(self) -> None:
        """Write the facts to `WORK`, for other processes. Failures are ignored: a full disk must not end a run here."""
        facts = {"pid": self.pid, "host": self.host, "since": self.since, "running": self.running}
        draft = self.folder / f"{WORK}.{self.pid}"
        with suppress(OSError):
            # "x" makes a new file: opened in any other way, a link that lies there would be followed
            draft.unlink(missing_ok=True)
            with draft.open("x", encoding="utf-8") as file:
                json.dump(facts, file)
            move(draft, self.folder / WORK)

    @property
    def is_alive(self) -> bool:
        """Does the process that wrote this run on this machine? No if another one has its number by now."""
        import psutil

        if self.host != platform.node():
            return False
        with suppress(psutil.Error, ValueError, OverflowError):  # the number may be anything
            process = psutil.Process(self.pid)
            has_ended = process.status() == psutil.STATUS_ZOMBIE
            return not has_ended and process.create_time() <= self.since + _STARTED
        return False

    @classmethod
    def read(cls, folder: Path) -> "Work | None":
        """What the holder wrote last; None if there is no such file, or it holds something else."""
        try:
            found = read_json(folder / WORK, most=_MOST_BYTES)
            running = {str(key): float(begun) for key, begun in found["running"].items()}
            work = cls(folder, int(found["pid"]), str(found["host"]), float(found["since"]), running)
            # the folder may come from anywhere, and these facts are printed
            times = (work.since, *running.values())
            is_plain = not hidden_in(work.host) and work.pid > 0 and all(0 <= one <= _LATEST for one in times)
            return work if is_plain else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError):
            return None


_held: dict[tuple[Path, int], Work] = {}  # by folder and thread: only the thread that holds a lock may enter again


@contextmanager
def locked(folder: Path) -> Iterator[Work]:
    """Hold the lock of a run folder while the block runs. The thread that holds it may ask again.

    The system frees the lock when the process ends, however it ends. Where nothing can be locked, it is said once;
    of processes on one machine, only one is let in all the same.

    Raises
    ------
    UserError
        If another process holds it, or the folder cannot be locked.
    """
    place = folder.resolve()
    key = place, get_ident()
    if key in _held:
        yield _held[key]
        return
    with ExitStack() as stack:
        try:
            taken = stack.enter_context(held(place, place / LOCK, patience=_PATIENCE))
            if place not in taken and _works_here(place):  # `LOCK` may have been deleted
                raise Busy
        except Busy:
            raise UserError(
                f"run folder {str(folder)!r} is in use by {_holder(folder)}: wait for it, or end it"
            ) from None
        except OSError as error:
            raise UserError(f"run folder {str(folder)!r} cannot be locked: {cause(error)}") from error
        if not taken:
            remark_once(f"nothing can be locked in {str(folder)!r}: let no other machine work on it meanwhile")
        work = _held[key] = Work(place)
        work.tell()
        try:
            yield work
        finally:
            del _held[key]
            with suppress(OSError):
                (place / WORK).unlink(missing_ok=True)


def is_locked(folder: Path) -> bool:
    """Does a process work on a run folder?"""
    place = folder.resolve()
    of_folder = is_held(place)
    if of_folder is None:
        return bool(is_held(place / LOCK)) or _works_here(place)
    return of_folder or bool(is_held(place / LOCK))


def _works_here(place: Path) -> bool:
    """Is a process of this machine at work there, by what it says itself?"""
    if any(place == one for one, _ in _held):
        return True
    work = Work.read(place)
    return work is not None and work.pid != os.getpid() and work.is_alive


def _holder(folder: Path) -> str:
    work = Work.read(folder)
    return f"process {work.pid} on {work.host}" if work else "another process"
