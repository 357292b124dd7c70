"""A run on disk: plan, cells and tables. A cell is there whole, or it is not there."""

import json
import os
import re
import shutil
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from errno import EISDIR, ELOOP, ENOENT, ENOTDIR, ENOTEMPTY
from functools import cached_property
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.errors import UserError
from matbench.files.writing import write_text
from matbench.measures.volumes import StoredVolume
from matbench.plans.plan import Cell, Plan
from matbench.runs import provenance
from matbench.runs.lock import LOCK, WORK, locked
from matbench.runs.outcome import Outcome

KEY = re.compile(r"[0-9a-f]{16}")
"""What a cell's folder is called."""
_DRAFT = re.compile(r"\.([0-9a-f]{16}|removed)\.\w+")
_ABSENT = (ENOENT, ENOTDIR, EISDIR, ELOOP)  # no such file; after any other error there may well be one
_MAP_BYTES = 1 << 32  # of all maps of a cell, unpacked

_json = make_converter()


@frozen(eq=False)
class Solved:
    """A stored cell. Its facts and its maps are read together, so they belong to the same solve.

    Parameters
    ----------
    outcome
        None if it has not been computed, or its files are damaged.
    place
        Its folder.
    maps
        View index -> (H, W) disparity map, pixels per view step; empty unless it is ok.
    """

    cell: Cell
    outcome: Outcome | None
    place: Path
    maps: Mapping[int, NDArray[np.float32]] = {}

    @cached_property
    def volume(self) -> StoredVolume | None:
        """The stored volume, read only when it is asked for: it is large. None if there is none, or it is damaged."""
        return _volume(self.place) if self.outcome is not None and self.outcome.has_volume else None


class FolderLost(UserError):
    """The run folder can no longer be written or read: the disk is full, or the network is gone."""

    @classmethod
    def of(cls, folder: Path, error: OSError) -> "FolderLost":
        why = error.strerror or str(error)
        return cls(f"run folder {str(folder)!r} cannot be used: {why}. What is finished stays; mend this and go on")


def maps_digest(maps: Mapping[int, NDArray[np.float32]]) -> str:
    """Sixteen hexadecimal digits of SHA-256 over disparity maps: views, sizes and every bit of the values."""
    digest = sha256()
    for view, values in sorted(maps.items()):
        digest.update(f"{view} {values.shape};".encode() + np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]


def read_maps(path: Path) -> dict[int, NDArray[np.float32]]:
    """View index -> (H, W) disparity map in a file, pixels per view step.

    Raises
    ------
    ValueError, OSError
        If the file is missing or holds something else.
    """
    with path.open("rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                # a small archive may unpack to more than the memory holds
                if sum(info.file_size for info in archive.infolist()) > _MAP_BYTES:
                    raise ValueError(f"{path} unpacks to more than {_MAP_BYTES} bytes")
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                maps = {int(name.removeprefix("view_")): arrays[name] for name in arrays.files}
        except (zipfile.BadZipFile, EOFError, TypeError, KeyError) as error:
            raise ValueError(f"{path} holds no disparity maps") from error
    if not maps or any(values.ndim != 2 or values.dtype != np.float32 for values in maps.values()):
        raise ValueError(f"{path} holds no disparity maps")
    return maps


def _to_disk(folder: Path) -> None:
    """Wait until a folder's files are on the disk. If they cannot be written, the error comes here and not later."""
    for path in [*folder.iterdir(), folder]:
        number = os.open(path, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


_TABLE_DRAFT = re.compile(
    r"\.(plan|scores|work|results|cells|sweeps|ablation|reliability|report)\.(json|csv|tex|html)\.\w+"
)


def _is_ours(name: str) -> bool:
    """Is a file of that name what a run leaves that is killed before it writes its plan? Such a folder may be used."""
    return name == LOCK or name.startswith((WORK, ".plan.json."))


@frozen
class Store:
    """One run folder."""

    folder: Path

    @classmethod
    def open(cls, folder: Path, plan: Plan, command: str = "") -> "Store":
        """Make a run folder for a plan, or continue the run there if it is of the same request.

        Parameters
        ----------
        command
            The line that asked for it.

        Raises
        ------
        UserError
            If the folder holds a different plan, or something that is no run, or another process works on it.
        """
        store = cls(folder)
        try:
            store.check(plan)
            folder.mkdir(parents=True, exist_ok=True)
            with locked(folder):
                store.check(plan)  # once more: before the lock, another process may have begun a run here
                store.write_plan(plan, command)
        except OSError as error:
            raise UserError(f"output folder {str(folder)!r} cannot be used: {error.strerror}") from error
        return store

    def check(self, plan: Plan) -> None:
        """Raise what `open` raises for a folder that cannot hold a plan; nothing is written."""
        folder = self.folder
        if folder.exists() and not folder.is_dir():
            raise UserError(f"output {str(folder)!r} is a file: name a folder that is new or holds this run")
        if (folder / "plan.json").exists():
            if self.request() != plan.request:
                raise UserError(f"output folder {str(folder)!r} holds a different plan: name another folder by --out")
        elif folder.exists() and not all(_is_ours(path.name) for path in folder.iterdir()):
            raise UserError(
                f"output folder {str(folder)!r} is not empty and holds no run: name another folder by --out"
            )
        self.check_place()

    def check_place(self) -> None:
        """Raise UserError if ``cells`` is a link: nothing outside of the run folder may be written or removed."""
        if (self.folder / "cells").is_symlink():
            raise UserError(f"{self.folder / 'cells'} is a link: the cells of a run lie in its own folder")

    def write_plan(self, plan: Plan, command: str = "") -> None:
        """Write ``plan.json`` and make the folder for cells, unless they exist."""
        path = self.folder / "plan.json"
        known = self._read(path).get("command", "") if path.exists() else ""
        facts = {"request": plan.request, "command": command or known, **_json.unstructure(plan)}
        text = json.dumps(facts, indent=1)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            write_text(path, text)
        (self.folder / "cells").mkdir(exist_ok=True)

    def _read(self, path: Path) -> dict[str, Any]:
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise UserError(f"{path} cannot be read: {error.strerror}; give a run folder") from error
        except (ValueError, RecursionError) as error:
            raise UserError(f"{path} is damaged: not JSON") from error
        if not isinstance(found, dict):
            raise UserError(f"{path} is damaged: not a JSON object")
        return found

    def request(self) -> Any:
        """What the run in this folder was asked for."""
        return self._read(self.folder / "plan.json").get("request")

    def command(self) -> str:
        """The line that asked for the run, if it is known."""
        return str(self._read(self.folder / "plan.json").get("command", ""))

    def plan(self) -> Plan:
        """The plan of the run in this folder."""
        try:
            plan = _json.structure(self._read(self.folder / "plan.json"), Plan)
        except Exception as error:  # whatever cattrs raises for a hostile or damaged plan
            if isinstance(error, UserError):
                raise
            raise UserError(f"{self.folder / 'plan.json'} is damaged: it is not a plan") from error
        if not all(KEY.fullmatch(c.key) for c in plan.cells):
            raise UserError(f"{self.folder / 'plan.json'} is damaged: a cell's key is not 16 hexadecimal digits")
        if not all(str(c).isprintable() for c in plan.cells):
            raise UserError(f"{self.folder / 'plan.json'} is damaged: a cell's name cannot be printed")
        return plan

    def cell(self, cell: Cell) -> Path:
        """Where a cell's files lie once it is done."""
        return self.folder / "cells" / cell.key

    def outcome(self, cell: Cell) -> Outcome | None:
        """A cell's outcome, without a look at its maps. None if it is not computed, or ``cell.json`` is damaged.

        Raises
        ------
        FolderLost
            If the folder cannot be read, so that its content is unknown.
        """
        try:
            facts = json.loads((self.cell(cell) / "cell.json").read_text(encoding="utf-8"))
            outcome = _json.structure(facts["outcome"], Outcome)
            numbers = (outcome.seconds, outcome.warmup_seconds, outcome.peak_mb)
            if not all(isfinite(number) for number in numbers if number is not None):
                return None
        except Exception as error:  # half a cell is no cell: it is computed anew
            self._check_readable(error)
            return None
        return outcome

    def read(self, cell: Cell) -> "Solved":
        """Read a cell with its maps, and check the maps against their digest.

        The outcome is None if the cell is not computed, or its files are damaged.

        Raises
        ------
        FolderLost
            If the folder cannot be read, so that its content is unknown.
        """
        outcome, place = self.outcome(cell), self.cell(cell)
        if outcome is None or outcome.status != "ok":
            return Solved(cell, outcome, place)
        try:
            maps = self.disparity(cell)
        except Exception as error:  # half a cell is no cell: it is computed anew
            self._check_readable(error)
            return Solved(cell, None, place)
        if outcome.maps and maps_digest(maps) != outcome.maps:
            return Solved(cell, None, place)
        return Solved(cell, outcome, place, maps)

    def _check_readable(self, error: Exception) -> None:
        """Raise FolderLost unless the error says that a file is missing or damaged."""
        if isinstance(error, OSError) and error.errno is not None and error.errno not in _ABSENT:
            raise FolderLost.of(self.folder, error) from error

    def fingerprint(self, cell: Cell) -> str:
        """SHA-256 of a stored cell's facts, which hold the digest of its maps; empty if there is none."""
        try:
            return sha256((self.cell(cell) / "cell.json").read_bytes()).hexdigest()
        except OSError:
            return ""

    def stale(self, plan: Plan) -> list[Cell]:
        """The stored cells that do not belong to the plan: those of other code, other pixels, other repeats."""
        current = {cell.key for cell in plan.cells}
        found = []
        for path in sorted((self.folder / "cells").glob("*/cell.json")):
            if path.parent.name in current or not KEY.fullmatch(path.parent.name):
                continue
            try:
                cell = _json.structure(json.loads(path.read_text(encoding="utf-8"))["cell"], Cell)
            except Exception:  # whatever a damaged one raises  # noqa: S112
                continue
            if cell.key == path.parent.name:
                found.append(cell)
        return found

    @contextmanager
    def building(self, cell: Cell) -> Iterator[Path]:
        """A draft folder for a cell. It becomes the cell's folder when the block ends; if the block fails, it goes."""
        draft = Path(tempfile.mkdtemp(prefix=f".{cell.key}.", dir=self.folder / "cells"))
        try:
            yield draft
            _to_disk(draft)
            draft.chmod(0o755)  # mkdtemp made it for this user alone, but others may read a run
            self._place(draft, cell)
        finally:
            shutil.rmtree(draft, ignore_errors=True)

    def _place(self, draft: Path, cell: Cell) -> None:
        for attempt in range(3):
            if os.path.lexists(self.cell(cell)):
                self.remove(cell)
            try:
                draft.replace(self.cell(cell))
            except OSError as error:  # somebody else's came in between
                if error.errno != ENOTEMPTY or attempt == 2:
                    raise
            else:
                return

    def remove(self, cell: Cell) -> None:
        """Remove a cell in one step: its folder is moved aside before its files are deleted."""
        aside = Path(tempfile.mkdtemp(prefix=".removed.", dir=self.folder / "cells"))
        with suppress(FileNotFoundError):
            self.cell(cell).replace(aside / cell.key)
        shutil.rmtree(aside, ignore_errors=True)

    def try_out(self) -> None:
        """Write a mebibyte and raise FolderLost if that fails: better before a long solve than after it."""
        try:
            with tempfile.TemporaryFile(dir=self.folder / "cells") as file:
                file.write(os.urandom(1 << 20))
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise FolderLost.of(self.folder, error) from error

    def recording(self, part: str | None = None) -> Path:
        """The recording of the one cell whose name or key contains `part`.

        Raises
        ------
        UserError
            If none has one, or several have.
        """
        paths = {str(c): self.cell(c) / "recording.rrd" for c in self.plan().cells}
        recorded = {name: path for name, path in paths.items() if path.exists()}
        if not recorded:
            raise UserError(f"run {str(self.folder)!r} has no recordings: only compare with --record writes them")
        hits = [name for name, path in recorded.items() if part is None or part in name or part in path.parent.name]
        exact = [name for name in hits if name == part]
        if len(exact or hits) != 1:
            which = f"{len(hits)} recordings match {part!r}" if part else f"there are {len(hits)} recordings"
            raise UserError(f"{which}: name one of {', '.join(map(repr, hits or recorded))}")
        return recorded[(exact or hits)[0]]

    def sweep(self) -> None:
        """Remove what killed runs have left: drafts of cells, and half-written tables."""
        self.check_place()
        for draft in (self.folder / "cells").glob(".*"):
            if _DRAFT.fullmatch(draft.name):
                shutil.rmtree(draft, ignore_errors=True)
        for draft in self.folder.glob(".*.*.*"):
            if _TABLE_DRAFT.fullmatch(draft.name):
                with suppress(OSError):
                    draft.unlink()

    def disparity(self, cell: Cell) -> dict[int, NDArray[np.float32]]:
        """View index -> (H, W) stored disparity map, pixels per view step.

        Raises
        ------
        ValueError, OSError
            If the file is missing or holds something else.
        """
        return read_maps(self.cell(cell) / "disparity.npz")

    def volume(self, cell: Cell) -> StoredVolume | None:
        """The stored volume; None if there is none, or it is damaged."""
        return _volume(self.cell(cell))


def _volume(place: Path) -> StoredVolume | None:
    try:
        return StoredVolume.read(place / "volume.npz")
    except (ValueError, OSError):
        return None


def write_cell(
    draft: Path,
    cell: Cell,
    outcome: Outcome,
    disparity: Mapping[int, NDArray[np.float32]] | None = None,
    volume: StoredVolume | None = None,
) -> None:
    """Fill a cell's draft folder with its facts and, if it has them, its maps and its volume."""
    if volume is not None:
        volume.write(draft / "volume.npz")
    if disparity is not None:
        arrays: dict[str, Any] = {f"view_{view}": values for view, values in disparity.items()}
        np.savez_compressed(draft / "disparity.npz", **arrays)
    maps = maps_digest(disparity) if disparity else outcome.maps
    outcome = evolve(outcome, maps=maps, ran_on={**provenance.ran_on(), **outcome.ran_on})
    facts = {"cell": _json.unstructure(cell), "outcome": _json.unstructure(outcome)}
    text = json.dumps(facts, indent=1, allow_nan=False)
    (draft / "cell.json").write_text(text, encoding="utf-8")
