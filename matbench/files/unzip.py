"""Unpacking wanted files from a zip archive that is not trusted.

The caller chooses members by their file names, and says where each one goes; the paths in the archive
are not used. The sizes that an archive states are not believed either: no more is unpacked than a given
number of bytes. Links, folders, encrypted members, and members with absolute paths or ``..`` in them
are passed over.
"""

import errno
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import BinaryIO
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo

from matbench.files.plain import NotPlain, open_plain

CHUNK = 1 << 16
MOST_AT_ONCE = 1 << 25
"""Bytes that `zipfile` may read in one piece. It reads the list of members so: of this size, it has 300,000 of them."""
RATIO = 200
"""A member may unpack to so many times its packed size, or to a mebibyte: pictures stay far below."""
FREE = 1 << 20
_ENCRYPTED = 0x1


class ArchiveError(Exception):
    """An archive, or a member of one, that cannot be used, and why, in one line."""


class _Piecewise:
    """A file of which no more than `MOST_AT_ONCE` bytes are read in one piece."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.seek, self.tell, self.seekable, self.close = file.seek, file.tell, file.seekable, file.close

    def read(self, size: int = -1) -> bytes:
        if size > MOST_AT_ONCE:
            raise BadZipFile(f"its list of members claims {size} bytes")
        if size < 0:
            here, end = self.tell(), self.seek(0, 2)
            self.seek(here)
            size = min(end - here, MOST_AT_ONCE)
        return self._file.read(size)


@contextmanager
def opened(path: Path) -> Iterator[ZipFile]:
    """An archive to read.

    Raises
    ------
    ArchiveError
        If it is none, cannot be read, is damaged, or has more than some hundred thousand members.
    """
    try:
        file = open_plain(path)
    except (NotPlain, OSError) as error:
        raise ArchiveError(f"no zip archive: {error}") from error
    with file, archive_in(file) as archive:
        yield archive


@contextmanager
def archive_in(file: BinaryIO) -> Iterator[ZipFile]:
    """The archive in an open file.

    Raises
    ------
    ArchiveError
        If there is none, it is damaged, or has more than some hundred thousand members.
    """
    with damage_told("no zip archive"):
        archive = ZipFile(_Piecewise(file))
    with archive:
        yield archive


@contextmanager
def damage_told(what: str) -> Iterator[None]:
    """Whatever damaged archives and arrays raise becomes an ArchiveError; a disk that fails stays an OSError."""
    try:
        yield
    except ArchiveError:
        raise
    except Exception as error:
        # a wrong offset is an "invalid argument" to the system
        if isinstance(error, OSError) and error.errno not in (None, errno.EINVAL):
            raise
        raise ArchiveError(f"{what}: {str(error) or type(error).__name__}") from error


def members(archive: ZipFile, names: Sequence[str]) -> list[ZipInfo]:
    """The safe members with one of these file names, whatever folder they lie in.

    Several members may have the same file name; the caller tells them apart by their content. Members in
    fewer folders come first; among these, the order is that of `names`.
    """
    found = [info for info in archive.infolist() if _path(info).name in names and is_safe(info)]
    return sorted(found, key=lambda info: (len(_path(info).parts), names.index(_path(info).name)))


def unpack(archive: ZipFile, info: ZipInfo, target: Path, limit: int) -> int:
    """Write a member to a new file `target`; how many bytes.

    Raises
    ------
    ArchiveError
        If it is damaged, or unpacks to more than `limit` bytes or `RATIO` times its packed size.
    OSError
        If `target` cannot be written.
    """
    limit = min(limit, max(FREE, RATIO * info.compress_size))
    count = 0
    with target.open("xb") as file:
        for chunk in _chunks(archive, info):
            count += len(chunk)
            if count > limit:
                raise ArchiveError(f"{info.filename} unpacks to more than {limit} bytes: that cannot be right")
            file.write(chunk)
    return count


def _chunks(archive: ZipFile, info: ZipInfo) -> Iterator[bytes]:
    with damage_told(f"{info.filename} is damaged"), archive.open(info) as member:
        while chunk := member.read(CHUNK):
            yield chunk


def _path(info: ZipInfo) -> PurePosixPath:
    return PurePosixPath(info.filename)


def is_safe(info: ZipInfo) -> bool:
    """Is a member a plain file, packed in a usual way, with a path that leads nowhere else?"""
    path, mode = _path(info), info.external_attr >> 16
    return (
        not info.is_dir()
        and not path.is_absolute()
        and ".." not in path.parts
        and "\\" not in info.filename
        and ":" not in info.filename
        and stat.S_IFMT(mode) in (0, stat.S_IFREG)
        and not info.flag_bits & _ENCRYPTED
        and info.compress_type in (ZIP_STORED, ZIP_DEFLATED)
    )
