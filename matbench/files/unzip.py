"""Unpacking wanted files from a zip archive that is not trusted.

The caller chooses members by their file names, and says where each one goes; the paths in the archive
are not used. The sizes that an archive states are not believed either: no more is unpacked than a given
number of bytes. Links, folders, encrypted members, and members with absolute paths or ``..`` in them
are passed over.
"""

import stat
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo

CHUNK = 1 << 16
RATIO = 200
"""A member may unpack to so many times its packed size, or to a mebibyte: pictures stay far below."""
_FREE = 1 << 20
_ENCRYPTED = 0x1
_DAMAGED = (BadZipFile, zlib.error, struct.error, EOFError, OSError, OverflowError, RuntimeError, ValueError)


class ArchiveError(Exception):
    """An archive, or a member of one, that cannot be used, and why, in one line."""


@contextmanager
def opened(path: Path) -> Iterator[ZipFile]:
    """An archive to read.

    Raises
    ------
    ArchiveError
        If it is none, or is damaged.
    """
    try:
        archive = ZipFile(path)
    except _DAMAGED as error:
        raise ArchiveError(f"no zip archive: {error}") from error
    with archive:
        yield archive


def members(archive: ZipFile, names: Sequence[str]) -> list[ZipInfo]:
    """The safe members with one of these file names, whatever folder they lie in.

    Several members may have the same file name; the caller tells them apart by their content. Members in
    fewer folders come first; among these, the order is that of `names`.
    """
    found = [info for info in archive.infolist() if _path(info).name in names and _is_safe(info)]
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
    limit = min(limit, max(_FREE, RATIO * info.compress_size))
    count = 0
    with target.open("xb") as file:
        for chunk in _chunks(archive, info):
            count += len(chunk)
            if count > limit:
                raise ArchiveError(f"{info.filename} unpacks to more than {limit} bytes: that cannot be right")
            file.write(chunk)
    return count


def _chunks(archive: ZipFile, info: ZipInfo) -> Iterator[bytes]:
    try:
        with archive.open(info) as member:
            while chunk := member.read(CHUNK):
                yield chunk
    except _DAMAGED as error:
        raise ArchiveError(f"{info.filename} is damaged: {error}") from error


def _path(info: ZipInfo) -> PurePosixPath:
    return PurePosixPath(info.filename)


def _is_safe(info: ZipInfo) -> bool:
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
