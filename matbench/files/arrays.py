"""Arrays in ``.npz`` and ``.npy`` files that are not trusted: what each claims to be is known before it is unpacked."""

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from math import prod
from pathlib import Path
from typing import IO, Any
from zipfile import ZipFile, ZipInfo

import numpy as np
from attrs import frozen
from numpy.lib import format as npy
from numpy.typing import NDArray

from matbench.files import unzip
from matbench.files.plain import open_plain

FREE, RATIO = 1 << 26, 200
"""An honest file of arrays unpacks to at most so many bytes, or so many times its size (`Arrays.check_ratio`).

Volumes and maps that were measured unpack to 20 to 40 times their size, but a constant one to a thousand times.
"""
_MOST_PACKED = 1040  # times that `deflate` can pack anything


class ArraysError(ValueError):
    """A file that holds no arrays, or others than it may, and why, in one line."""


@contextmanager
def _told(what: str) -> Iterator[None]:
    try:
        with unzip.damage_told(what):
            yield
    except unzip.ArchiveError as error:
        raise ArraysError(str(error)) from error


@frozen
class Claim:
    """What a file says of one of its arrays."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def bytes(self) -> int:
        return prod(self.shape) * self.dtype.itemsize


@frozen(eq=False)
class Arrays:
    """The arrays of an open file.

    Parameters
    ----------
    claims
        Name -> what it claims to be. Its length in the archive is that of the claim; whether so much follows is
        only seen when it is read.
    size
        Bytes of the file.
    """

    claims: Mapping[str, Claim]
    size: int
    _archive: ZipFile
    _members: Mapping[str, ZipInfo]

    @property
    def bytes(self) -> int:
        """All arrays, unpacked."""
        return sum(claim.bytes for claim in self.claims.values())

    def check_ratio(self) -> None:
        """Raise ArraysError if the arrays claim many times the bytes of the file: see `write_arrays`."""
        if self.bytes > _allowed(self.size):
            raise ArraysError(f"{self.size} bytes claim to hold arrays of {self.bytes}: more than {RATIO} times")

    def read(self, name: str) -> NDArray[Any]:
        """Unpack one array.

        Raises
        ------
        ArraysError
            If there is none of that name, it is damaged, or there is no room for it.
        """
        if name not in self._members:
            raise ArraysError(f"there is no array {name!r}")
        with _told(f"array {name!r} is damaged"), self._archive.open(self._members[name]) as member:
            found: NDArray[Any] = npy.read_array(member, allow_pickle=False)
            member.read(1)  # the end of the member: its checksum is looked at there
        return found


@contextmanager
def opened_arrays(path: Path, *, follow: bool = True) -> Iterator[Arrays]:
    """Open a ``.npz`` file and read what each array claims to be.

    Raises
    ------
    ArraysError
        If it is no plain file, no archive, holds anything but arrays of numbers or texts, or contradicts itself.
    OSError
        If it is missing or cannot be read.
    """
    with ExitStack() as stack:
        with _told(path.name):
            file = stack.enter_context(open_plain(path, follow=follow))
            archive = stack.enter_context(unzip.archive_in(file))
            every = archive.infolist()
        members = {info.filename.removesuffix(".npy"): info for info in every}
        if len(members) != len(every):
            raise ArraysError(f"{path.name}: two arrays have one name")
        size = os.fstat(file.fileno()).st_size
        yield Arrays({name: _claim(archive, info, size) for name, info in members.items()}, size, archive, members)


def read_array(path: Path, most: int) -> NDArray[Any]:
    """The array in a ``.npy`` file of at most so many bytes, which holds all that it claims.

    Raises
    ------
    ArraysError, OSError
        As `opened_arrays`.
    """
    with _told(path.name), open_plain(path, most=most) as file:
        claim, size = _claim_at(file), os.fstat(file.fileno()).st_size
        if file.tell() + claim.bytes > size:
            raise ArraysError(f"{path.name} has {size} bytes, too few for {claim.shape} {claim.dtype}")
        file.seek(0)
        found: NDArray[Any] = npy.read_array(file, allow_pickle=False)
    return found


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays compressed; if their ratio would then be refused (`Arrays.check_ratio`), as they are."""
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]  # names are those of arrays
    if sum(array.nbytes for array in arrays.values()) > _allowed(path.stat().st_size):
        np.savez(path, **arrays)  # type: ignore[arg-type]


def _allowed(size: int) -> int:
    return max(FREE, RATIO * size)


def _claim(archive: ZipFile, info: ZipInfo, size: int) -> Claim:
    name = info.filename
    if not (name.endswith(".npy") and unzip.is_safe(info)):
        raise ArraysError(f"{name!r} is no array")
    if info.compress_size > size or info.file_size > _MOST_PACKED * info.compress_size:
        raise ArraysError(f"{name!r} claims {info.file_size} bytes from {info.compress_size}: that cannot be")
    with _told(f"array {name!r} is damaged"), archive.open(info) as member:
        claim = _claim_at(member)
        header = member.tell()
    if header + claim.bytes != info.file_size:
        raise ArraysError(f"{name!r} has {info.file_size} bytes, which are not {claim.shape} {claim.dtype}")
    return claim


def _claim_at(file: IO[bytes]) -> Claim:
    """What the header of an array says, which is read."""
    shape, _, dtype = _HEADERS[npy.read_magic(file)](file)
    if dtype.kind not in "biufU" or any(length < 0 for length in shape):
        raise ArraysError(f"it claims to be {shape} {dtype}, which are no numbers or texts")
    return Claim(shape, dtype)


_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
