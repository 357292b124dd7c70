"""A run as one archive: all that is needed to check its tables, and nothing that can harm the person who opens it."""

import json
import re
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

from matbench._version import __version__
from matbench.errors import UserError
from matbench.files import unzip
from matbench.files.documents import read_json
from matbench.files.plain import digest_plain, open_plain
from matbench.files.writing import drafted, is_writable
from matbench.plans.plan import Cell
from matbench.results import freshness
from matbench.runs.lock import locked
from matbench.runs.store import Store

MANIFEST = "manifest.json"
TOP = (
    "plan.json",
    "scores.json",
    "results.csv",
    "cells.csv",
    "sweeps.csv",
    "ablation.csv",
    "ablation.tex",
    "reliability.csv",
    "sparsification.csv",
    "report.html",
)
"""The files of a run folder that are exported, besides the cells."""
CELL = ("cell.json", "disparity.npz", "confidence.npz", "volume.npz", "log.txt")
"""The files of a cell that are exported. Recordings are not: they are large, and no score depends on them."""

_NAME = re.compile(rf"({'|'.join(map(re.escape, TOP))})|cells/[0-9a-f]{{16}}/({'|'.join(map(re.escape, CELL))})")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the same time for all members: an archive's bytes do not depend on when it is written
_MOST = 1 << 26  # bytes of a manifest
_FREE, _RATIO = 1 << 28, 100  # an archive unpacks to at most so many bytes, or so many times its size
_CHUNK = 1 << 20


def files_of(store: Store, cell: Cell) -> list[Path]:
    """The files of a cell to export. Links are left out: one could lead to any file on this machine."""
    place = store.cell(cell)
    return [] if place.is_symlink() else [path for name in CELL if _is_plain(path := place / name)]


def tables_of(store: Store) -> list[Path]:
    """The files of a run to export, besides its cells. Links are left out."""
    return [path for name in TOP if _is_plain(path := store.folder / name)]


def export(folder: Path, out: Path | None = None) -> tuple[Path, int]:
    """Write a run as one archive. The same run gives the same bytes, at any time and on any machine.

    The archive holds the plan, the tables, the report, and the facts, maps, volume and log of every cell
    of the plan. Stored cells that do not belong to the plan are left out. ``manifest.json`` holds the
    SHA-256 of each file.

    Parameters
    ----------
    out
        Path of the archive. If not given, it is put beside the folder, or where this user may not write there,
        into the working folder. An archive that exists there is replaced.

    Returns
    -------
    The archive's path, and how many cells of the plan it lacks because they are not done.

    Raises
    ------
    UserError
        If the folder holds no run, its tables are stale, or another process works on it.
    """
    store = Store(folder)
    store.check_place()
    plan = store.plan()
    # the folder "." has no name of its own
    named = folder if folder.name else folder.resolve()
    place = out or named.with_name(f"{named.name}.zip")
    if out is None and not is_writable(place.parent):
        place = Path(place.name)
    # an earlier export may be replaced, but never a file of another kind
    if place.exists() and not _is_archive(place):
        raise UserError(f"{str(place)!r} is there already and is no exported run: name another file by --out")
    with locked(folder):
        if why := freshness.fault(plan, store):
            then = "first" if is_writable(folder) else "and export that"
            raise UserError(f"{freshness.stale(folder, why)} {then}")
        done = [cell for cell in plan.cells if store.read(cell).outcome is not None]
        paths = tables_of(store)
        paths += [path for cell in done for path in files_of(store, cell)]
        _write(place, folder, sorted(paths))
    return place, len(plan.cells) - len(done)


def unpack(path: Path, folder: Path) -> None:
    """Unpack an exported run into a new folder, and check every file by its digest.

    Raises
    ------
    UserError
        If it is no such archive, holds anything else, or a file differs from what the manifest says.
    """
    try:
        with unzip.opened(path) as archive:
            members = _members(archive)
            (folder / "cells").mkdir(parents=True)
            manifest = _manifest(archive, members.pop(MANIFEST), folder)
            if set(manifest) != set(members):
                odd = sorted(set(manifest) ^ set(members))[0]
                raise unzip.ArchiveError(f"{odd} stands only in the manifest, or is only in the archive")
            left = max(_FREE, _RATIO * path.stat().st_size)
            for name, info in members.items():
                target = folder / name
                target.parent.mkdir(exist_ok=True)
                left -= unzip.unpack(archive, info, target, limit=min(left, info.file_size))
                if digest_plain(target) != manifest[name]:
                    raise unzip.ArchiveError(f"{name} is not what it was when the run was exported")
    except unzip.ArchiveError as error:
        raise UserError(f"{str(path)!r} cannot be used: {error}") from error


def _members(archive: ZipFile) -> dict[str, ZipInfo]:
    """Name -> member. The archive must hold nothing but what `export` writes."""
    names = [info.filename for info in archive.infolist()]
    safe = {info.filename: info for info in unzip.members(archive, (MANIFEST, *TOP, *CELL))}
    for name in names:
        if name not in safe or not (name == MANIFEST or _NAME.fullmatch(name)):
            raise unzip.ArchiveError(f"it holds {name!r}, which is no file of an exported run")
    if len(set(names)) != len(names):
        raise unzip.ArchiveError("it holds two files of one name")
    if MANIFEST not in safe:
        raise unzip.ArchiveError(f"it has no {MANIFEST}, so it is no exported run")
    return safe


def _manifest(archive: ZipFile, info: ZipInfo, folder: Path) -> dict[str, str]:
    with tempfile.TemporaryDirectory(dir=folder) as place:
        target = Path(place) / MANIFEST
        unzip.unpack(archive, info, target, limit=_MOST)
        try:
            files = read_json(target, most=_MOST)["files"]
            return {str(name): str(facts["sha256"]) for name, facts in files.items()}
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise unzip.ArchiveError(f"its {MANIFEST} is damaged") from error


def _is_archive(path: Path) -> bool:
    try:
        with unzip.opened(path) as archive:
            return MANIFEST in archive.namelist()
    except unzip.ArchiveError:
        return False


def _is_plain(path: Path) -> bool:
    """Is it a file, and no link to one elsewhere?"""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def _write(place: Path, folder: Path, paths: list[Path]) -> None:
    files = {
        p.relative_to(folder).as_posix(): {"sha256": digest_plain(p, follow=False), "bytes": p.stat().st_size}
        for p in paths
    }
    manifest = json.dumps({"matbench": __version__, "files": files}, indent=1)
    with drafted(place) as file, ZipFile(file, "w") as archive:
        archive.writestr(_info(MANIFEST), manifest)
        for path in paths:
            info = _info(path.relative_to(folder).as_posix())
            info.file_size = path.stat().st_size
            with archive.open(info, "w") as member:
                for chunk in _chunks(path):
                    member.write(chunk)


def _info(name: str) -> ZipInfo:
    info = ZipInfo(name, _EPOCH)
    # arrays are compressed already; the system is named because it would differ between machines
    info.compress_type = ZIP_STORED if name.endswith(".npz") else ZIP_DEFLATED
    info.create_system, info.external_attr = 3, (stat.S_IFREG | 0o644) << 16
    return info


def _chunks(path: Path) -> Iterator[bytes]:
    with open_plain(path, follow=False) as file:
        while chunk := file.read(_CHUNK):
            yield chunk
