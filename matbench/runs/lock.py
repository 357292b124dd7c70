"""The lock of a run folder: one process works on it at a time, and others can see which one, and on what."""

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
"""Two files in a run folder. The first is locked; the system unlocks it when the process that holds it ends. The
second says who holds the lock, for people to read."""

_PATIENCE = 2.0  # seconds to wait: another process that only asks `is_locked` holds the lock for a moment, too


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
            draft.replace(self.folder / WORK)

    @classmethod
    def read(cls, folder: Path) -> "Work | None":
        """What the holder wrote last; None if there is no such file, or it holds something else."""
        try:
            found = json.loads((folder / WORK).read_text(encoding="utf-8"))
            running = {str(key): float(begun) for key, begun in found["running"].items()}
            work = cls(folder, int(found["pid"]), str(found["host"]), float(found["since"]), running)
            # the folder may come from anywhere, and these facts are printed
            is_plain = work.host.isprintable() and all(map(isfinite, (work.since, *running.values())))
            return work if is_plain else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return None


_held: dict[tuple[Path, int], Work] = {}  # by folder and thread: only the thread that holds a lock may enter again


@contextmanager
def locked(folder: Path) -> Iterator[Work]:
    """Hold the lock of a run folder while the block runs. The thread that holds it may ask again.

    The system frees the lock when the process ends, however it ends.

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
    """Does a process work on a run folder? The answer is no where this process may not lock the folder."""
    if (folder.resolve(), get_ident()) in _held:
        return True
    if not (folder / LOCK).exists():
        return False
    # the file stays when a run ends: only an attempt to lock it tells
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
