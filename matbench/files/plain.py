"""Opening files that are not trusted: plain files only, and no more of them than a given number of bytes.

What lies under a name may be a pipe that never ends, a device that acts when it is opened, or a link to either.
"""

import errno
import os
import stat
from hashlib import sha256
from pathlib import Path
from typing import BinaryIO

_CHUNK = 1 << 16
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFLNK: "a link",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


class NotPlain(ValueError):
    """What lies under a name is no plain file, or holds more than may be read; said in one line."""


def open_plain(path: Path, *, most: int | None = None, follow: bool = True) -> BinaryIO:
    """Open a file to read, if it is a plain one. It never waits at a pipe.

    Parameters
    ----------
    most
        Bytes that it may have; None for any number.
    follow
        May it be a link to a plain file? Where others can write into the folder, a link may lead anywhere.

    Raises
    ------
    NotPlain
        If it is something else, or larger.
    OSError
        If there is none, or it cannot be opened.
    """
    try:
        facts = path.stat(follow_symlinks=follow)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise NotPlain(f"{path.name} is a link that leads to itself and no file") from None
        raise
    _check(path, facts, most)  # first: a device may act when it is opened
    number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | (0 if follow else os.O_NOFOLLOW))
    try:
        _check(path, os.fstat(number), most)  # again: it may have been replaced
        return os.fdopen(number, "rb")
    except BaseException:
        os.close(number)
        raise


def read_plain(path: Path, *, most: int, follow: bool = True) -> bytes:
    """The content of a plain file of at most so many bytes.

    Raises
    ------
    NotPlain, OSError
        As `open_plain`.
    """
    with open_plain(path, most=most, follow=follow) as file:
        content = file.read(os.fstat(file.fileno()).st_size + 1)
        # files of the system, such as those in /proc, claim to be empty
        while len(content) <= most and (more := file.read(_CHUNK)):
            content += more
    if len(content) > most:
        raise NotPlain(f"{path.name} has more than {most} bytes")
    return content


def digest_plain(path: Path, *, most: int | None = None, follow: bool = True) -> str:
    """SHA-256 of a plain file, which is never in memory as a whole.

    Raises
    ------
    NotPlain, OSError
        As `open_plain`.
    """
    digest, count = sha256(), 0
    with open_plain(path, most=most, follow=follow) as file:
        while chunk := file.read(_CHUNK):
            count += len(chunk)
            if most is not None and count > most:
                raise NotPlain(f"{path.name} has more than {most} bytes")
            digest.update(chunk)
    return digest.hexdigest()


def digest_content(path: Path) -> str:
    """SHA-256 of a plain file, or of all plain files below a folder with their names.

    Raises
    ------
    NotPlain, OSError
        As `open_plain`.
    """
    if not path.is_dir():
        return digest_plain(path)
    files = sorted(file for file in path.rglob("*") if file.is_file())
    each = [f"{file.relative_to(path).as_posix()}\0{digest_plain(file)}" for file in files]
    return sha256("\0".join(each).encode("utf-8", "surrogateescape")).hexdigest()


def _check(path: Path, facts: os.stat_result, most: int | None) -> None:
    kind = stat.S_IFMT(facts.st_mode)
    if kind != stat.S_IFREG:
        raise NotPlain(f"{path.name} is {_KINDS.get(kind, 'something else')} and no file")
    if most is not None and facts.st_size > most:
        raise NotPlain(f"{path.name} has {facts.st_size} bytes: {most} are possible")
