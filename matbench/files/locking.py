"""Locks on files and folders, which the system frees when the process that holds them ends."""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EACCES, EAGAIN, ENOENT, ENOLCK, EPERM, EROFS
from pathlib import Path

from matbench.files.writing import NOT_OFFERED

_NONE = NOT_OFFERED | {ENOLCK}  # NFS answers EBADF for folders
_HELD = {EAGAIN, EACCES}  # the latter by SMB
_TICK = 0.05  # seconds between two tries


class Busy(Exception):
    """Another process holds the lock."""


@contextmanager
def held(*places: Path, patience: float = 0.0) -> Iterator[frozenset[Path]]:
    """Hold the locks of files and folders while the block runs.

    A lock on a folder stays whatever is deleted in it. A file is made if it is not there, and where it can be.

    Parameters
    ----------
    patience
        Seconds to wait while another process holds one.

    Yields
    ------
    Those that are locked: the others lie where nothing can be locked, or may not be opened.

    Raises
    ------
    Busy
        If another process holds one of them.
    OSError
        If one of them is a link, or cannot be opened for another reason than that this user may not.
    """
    end = time.monotonic() + patience
    taken: dict[Path, int] = {}
    try:
        for place in places:
            if (number := _taken(place, end)) is not None:
                taken[place] = number
        yield frozenset(taken)
    finally:
        for number in taken.values():
            os.close(number)


def is_held(place: Path) -> bool | None:
    """Does another process hold the lock of a file or folder? None where this cannot be told."""
    try:
        number = _opened(place, make=False)
    except OSError:
        return None
    if number is None:
        return None
    try:
        # shared, so that two who ask at once do not take each other for a holder
        fcntl.flock(number, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        return True if error.errno in _HELD else None
    finally:
        os.close(number)
    return False


def _taken(place: Path, end: float) -> int | None:
    """The descriptor that holds the lock; None where nothing can be locked."""
    while (number := _opened(place, make=True)) is not None:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_still(place, number):
                return number
        except OSError as error:
            os.close(number)
            if error.errno in _NONE:
                return None
            if error.errno not in _HELD:
                raise
            if time.monotonic() > end:
                raise Busy from error
            time.sleep(_TICK)
        else:
            os.close(number)  # it was deleted meanwhile: the lock that counts is that of the file that is there now
    return None


def _opened(place: Path, make: bool) -> int | None:
    """A descriptor of a file or folder; None if it is not there, or this user may not open it."""
    ways = [os.O_RDONLY] if place.is_dir() or not make else [os.O_RDWR | os.O_CREAT, os.O_RDONLY]
    for flags in ways:  # to lock what others have made, reading is enough
        try:
            return os.open(place, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
        except OSError as error:
            if error.errno not in (EACCES, EPERM, EROFS, ENOENT):
                raise
    return None


def _is_still(place: Path, number: int) -> bool:
    """Is what has been opened still what lies there?"""
    with suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(number), place.lstat())
    return False
