"""Files and folders that are there whole or not at all, also where a file system refuses some of the usual calls.

What is made gets the rights that the user's umask and the folder above say, so that a group can share it.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from errno import EACCES, EBADF, EEXIST, EINVAL, EISDIR, ENOSYS, ENOTSUP, EOPNOTSUPP, EPERM, EROFS
from pathlib import Path
from secrets import token_hex
from typing import BinaryIO

NOT_OFFERED = frozenset({EINVAL, ENOSYS, ENOTSUP, EOPNOTSUPP, EPERM, EBADF})
"""What a file system answers to a call that it does not offer, such as SMB, FAT or an S3 mount; no failure."""


def write_text(path: Path, text: str) -> None:
    """Write a file beside its place and move it there whole."""
    # half a character, which has no bytes in UTF-8, is written as its escape: one name costs no table
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file beside its place and move it there whole."""
    with drafted(path) as file:
        file.write(content)


@contextmanager
def drafted(path: Path, *, settled: bool = True) -> Iterator[BinaryIO]:
    """A new file beside `path`. It is moved there when the block ends, and replaces what is there; else it goes.

    Parameters
    ----------
    settled
        Wait until it is on the disk (`settle`)? Not where a reader tells by its digest whether a power cut has cut it.
    """
    draft = path.with_name(_draft(path.name))
    try:
        with draft.open("xb") as file:
            yield file
            if settled:
                file.flush()
                settle(file.fileno())
        move(draft, path)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename == str(draft):
            error.filename = str(path)  # the name that its reader knows
        raise


def draft_folder(folder: Path, name: str) -> Path:
    """A new folder in a folder, for what is to become `name`.

    `tempfile` would make it for this user alone.
    """
    draft = folder / _draft(name)
    draft.mkdir()
    return draft


def _draft(name: str) -> str:
    return f".{name}.{token_hex(4)}"


def move(draft: Path, place: Path) -> None:
    """Move a file to its place, also where another is."""
    try:
        draft.replace(place)
    except OSError as error:
        if error.errno not in NOT_OFFERED | {EEXIST, EACCES} or not os.path.lexists(place):
            raise
        # nothing can be moved over another file there; where this user may not, the next line fails, too
        aside = place.rename(place.with_name(_draft(place.name)))
        try:
            draft.replace(place)
        except BaseException:
            aside.rename(place)
            raise
        aside.unlink()


def is_writable(folder: Path) -> bool:
    """May this user write into a folder, and does it lie where anything can be written?"""
    return os.access(folder, os.W_OK, effective_ids=os.access in os.supports_effective_ids)


def settle(file: Path | int) -> bool:
    """Wait until a file or a folder is on the disk; False where the file system does not say.

    Raises
    ------
    OSError
        If it cannot be written: on a full disk, this may be the first to know.
    """
    try:
        if isinstance(file, int):
            os.fsync(file)
            return True
        number = os.open(file, os.O_RDONLY | os.O_NONBLOCK)
        try:
            os.fsync(number)
        finally:
            os.close(number)
    except OSError as error:
        if error.errno in NOT_OFFERED | {EROFS, EISDIR, EACCES}:
            return False
        raise
    return True
