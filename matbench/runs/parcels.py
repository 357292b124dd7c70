"""Cells that another machine has solved: packed into bytes there, checked and stored here."""

from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_STORED, ZipFile

from matbench.files.unzip import ArchiveError, members, opened, unpack
from matbench.plans.plan import Cell
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store

FILES = {
    "cell.json": 1 << 26,
    "log.txt": 1 << 20,
    "disparity.npz": 1 << 31,
    "volume.npz": 1 << 33,
    "recording.rrd": 1 << 33,
}
"""File that a cell may consist of -> its largest size in bytes, unpacked: a faulty sender must not fill the disk."""


def pack(folder: Path) -> bytes:
    """A cell's folder as a zip archive. Nothing is compressed: the large files are compressed already."""
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_STORED) as archive:
        for name in FILES:
            if (folder / name).is_file():
                archive.write(folder / name, name)
    return packed.getvalue()


def put(store: Store, cell: Cell, parcel: bytes) -> Outcome:
    """Check a cell that came as an archive, and store it whole or not at all. If it comes twice, the second one stays.

    Raises
    ------
    ArchiveError
        If the archive is not this cell, or is damaged. The store is then as it was.
    OSError
        If it cannot be written.
    """
    with TemporaryDirectory(dir=store.folder / "cells", prefix=f".{cell.key}.") as folder:
        # unpacked into a store of its own, where it is read like any cell: only a whole one is moved to its place
        beside = Store(Path(folder))
        place = beside.cell(cell)
        place.mkdir(parents=True)
        _unpack(parcel, Path(folder) / "parcel.zip", place)
        outcome = _outcome(beside, cell)
        with store.building(cell) as draft:
            for file in place.iterdir():
                file.replace(draft / file.name)
    return outcome


def _unpack(parcel: bytes, file: Path, place: Path) -> None:
    file.write_bytes(parcel)
    with opened(file) as archive:
        for info in members(archive, list(FILES)):
            if info.filename not in FILES or (place / info.filename).exists():
                raise ArchiveError(f"what came holds {info.filename!r}, which is no part of a cell")
            unpack(archive, info, place / info.filename, FILES[info.filename])


def _outcome(store: Store, cell: Cell) -> Outcome:
    """The outcome in files that claim to be this cell.

    Raises
    ------
    ArchiveError
        If they are another cell, or no whole one.
    """
    try:
        key = store.facts(cell)["cell"]["key"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ArchiveError("what came is no cell") from error
    outcome = store.read(cell).outcome
    if key != cell.key or outcome is None:
        raise ArchiveError("what came is a damaged cell" if key == cell.key else "what came is another cell")
    return outcome
