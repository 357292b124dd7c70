"""One process works on a run folder at a time; who, and on what, can be seen from elsewhere."""

import json
import os
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from threading import get_ident

from attrs import define, field
from filelock import FileLock, Timeout

from matbench.errors import UserError

LOCK, WORK = ".lock", ".work.json"
"""What lies in a run folder: the lock, which the system takes from a process that ends; and who has it, for people."""

_PATIENCE = 2.0  # seconds: `is_locked` holds the lock for a moment, too


@define
class Work:
    """What the process that holds the lock is at.

    Parameters
    ----------
    since
        Seconds since 1970 when it took the lock.
    running
        Key of each cell under way -> when it was started.
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
        """Write it down for others; a disk that is full must not end a run for this."""
        facts = {"pid": self.pid, "host": self.host, "since": self.since, "running": self.running}
        draft = self.folder / f"{WORK}.{self.pid}"
        with suppress(OSError):
            draft.unlink(missing_ok=True)
            with draft.open("x", encoding="utf-8") as file:
                json.dump(facts, file)
            draft.replace(self.folder / WORK)

    @classmethod
    def read(cls, folder: Path) -> "Work | None":
        """What was told last; None if nothing was, or something else lies there."""
        try:
            found = json.loads((folder / WORK).read_text(encoding="utf-8"))
            running = {str(key): float(begun) for key, begun in found["running"].items()}
            work = cls(folder, int(found["pid"]), str(found["host"]), float(found["since"]), running)
            is_plain = work.host.isprintable() and all(map(isfinite, (work.since, *running.values())))
            return work if is_plain else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return None


_held: dict[tuple[Path, int], Work] = {}  # folder and thread


@contextmanager
def locked(folder: Path) -> Iterator[Work]:
    """Be the one that works on a run folder; a thread that is may ask again.

    The system gives the lock back when a process ends, however it ends.

    Raises
    ------
    UserError
        If another process has it, or the folder cannot be locked.
    """
    place = folder.resolve()
    key = place, get_ident()
    if key in _held:
        yield _held[key]
        return
    lock = FileLock(place / LOCK)
    try:
        lock.acquire(timeout=_PATIENCE, poll_interval=0.05)
    except Timeout as error:
        raise UserError(f"run folder {str(folder)!r} is in use by {_holder(folder)}: wait for it, or end it") from error
    except (OSError, NotImplementedError) as error:
        raise UserError(f"run folder {str(folder)!r} cannot be locked: {error}") from error
    work = _held[key] = Work(place)
    work.tell()
    try:
        yield work
    finally:
        del _held[key]
        with suppress(OSError):
            (place / WORK).unlink(missing_ok=True)
        with suppress(OSError):
            lock.release()


def is_locked(folder: Path) -> bool:
    """Does a process work on a run folder? One that may not be written to is said to be at rest."""
    if (folder.resolve(), get_ident()) in _held:
        return True
    if not (folder / LOCK).exists():
        return False
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        return True
    except (OSError, NotImplementedError):
        return False
    lock.release()
    return False


def _holder(folder: Path) -> str:
    work = Work.read(folder)
    return f"process {work.pid} on {work.host}" if work else "another process"
