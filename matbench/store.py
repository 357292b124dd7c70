"""A run on disk: plan, cells and tables. A cell is there whole, or it is not there."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np
from attrs import frozen
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.errors import UserError
from matbench.plan import Cell, Plan
from matbench.recorded import Recording
from matbench.volumes import StoredVolume

Status = Literal["ok", "skipped", "failed", "timeout", "out-of-memory", "crashed", "interrupted"]
FINAL: frozenset[Status] = frozenset({"ok", "skipped"})

_json = make_converter()


@frozen
class Outcome:
    """What became of a cell.

    Parameters
    ----------
    seconds
        Wall time of the solve alone: no imports, no compilation, no recording.
    warmup_seconds
        Wall time of a first solve on a tiny scene of the same kind, compilation included.
    peak_mb
        Largest resident memory of the cell's process during the solve, in MiB.
    reason
        Why it is not `ok`, in one line.
    has_volume
        Did the estimate have a volume that could be kept? It is kept only on request.
    work, history
        As the estimate gave them; None for a number that is not finite.
    recorded
        What its recording holds, if it has one.
    alone
        Did no other cell of the run run meanwhile? Otherwise `seconds` is not comparable.
    """

    status: Status
    seconds: float | None = None
    warmup_seconds: float | None = None
    peak_mb: float | None = None
    threads: int | None = None
    reason: str = ""
    has_volume: bool = False
    work: Mapping[str, int] = {}
    history: Mapping[str, list[float | None]] = {}
    recorded: Recording | None = None
    alone: bool = True


def write_text(path: Path, text: str) -> None:
    """Write a file beside its place and move it there whole."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file beside its place and move it there whole."""
    with tempfile.NamedTemporaryFile("wb", dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
        try:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
            Path(file.name).chmod(0o644)
            Path(file.name).replace(path)
        except BaseException:
            Path(file.name).unlink(missing_ok=True)
            raise


@frozen
class Store:
    """One run folder."""

    folder: Path

    @classmethod
    def open(cls, folder: Path, plan: Plan) -> "Store":
        """Make a run folder for a plan, or take up the one that holds the same request.

        Raises
        ------
        UserError
            If the folder holds a different plan, or something that is no run.
        """
        store = cls(folder)
        try:
            store._claim(plan)
        except OSError as error:
            raise UserError(f"output folder {str(folder)!r} cannot be used: {error.strerror}") from error
        return store

    def _claim(self, plan: Plan) -> None:
        folder = self.folder
        if folder.exists() and not folder.is_dir():
            raise UserError(f"output {str(folder)!r} is a file: name a folder that is new or holds this run")
        if (folder / "plan.json").exists():
            if self.request() != plan.request:
                raise UserError(f"output folder {str(folder)!r} holds a different plan: name another folder by --out")
        elif folder.exists() and any(folder.iterdir()):
            raise UserError(
                f"output folder {str(folder)!r} is not empty and holds no run: name another folder by --out"
            )
        (folder / "cells").mkdir(parents=True, exist_ok=True)
        write_text(folder / "plan.json", json.dumps({"request": plan.request, **_json.unstructure(plan)}, indent=1))

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

    def plan(self) -> Plan:
        """The plan of the run in this folder."""
        try:
            plan = _json.structure(self._read(self.folder / "plan.json"), Plan)
        except Exception as error:  # whatever cattrs raises for a hostile or damaged plan
            if isinstance(error, UserError):
                raise
            raise UserError(f"{self.folder / 'plan.json'} is damaged: it is not a plan") from error
        if not all(len(c.key) == 16 and set(c.key) <= set("0123456789abcdef") for c in plan.cells):
            raise UserError(f"{self.folder / 'plan.json'} is damaged: a cell's key is not 16 hexadecimal digits")
        return plan

    def cell(self, cell: Cell) -> Path:
        """Where a cell's files lie once it is done."""
        return self.folder / "cells" / cell.key

    def outcome(self, cell: Cell) -> Outcome | None:
        """What became of a cell, or None if it has not been computed, or its files are damaged."""
        path = self.cell(cell) / "cell.json"
        if not path.exists():
            return None
        try:
            outcome = _json.structure(self._read(path)["outcome"], Outcome)
            if outcome.status == "ok":
                self.disparity(cell)
        except Exception:  # half a cell is no cell: it is computed anew
            return None
        return outcome

    @contextmanager
    def building(self, cell: Cell) -> Iterator[Path]:
        """A folder beside a cell's place, moved there when the block ends, removed if it fails."""
        draft = Path(tempfile.mkdtemp(prefix=f".{cell.key}.", dir=self.folder / "cells"))
        try:
            yield draft
            draft.chmod(0o755)
            place = self.cell(cell)
            if place.exists():
                self.remove(cell)
            draft.replace(place)
        finally:
            shutil.rmtree(draft, ignore_errors=True)

    def remove(self, cell: Cell) -> None:
        """Take a cell away, in one step: aside first, then to pieces."""
        aside = Path(tempfile.mkdtemp(prefix=".removed.", dir=self.folder / "cells"))
        with suppress(FileNotFoundError):
            self.cell(cell).replace(aside / cell.key)
        shutil.rmtree(aside, ignore_errors=True)

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
            raise UserError(f"run {str(self.folder)!r} has no recordings: type its compare command again with --record")
        hits = [name for name, path in recorded.items() if part is None or part in name or part in path.parent.name]
        exact = [name for name in hits if name == part]
        if len(exact or hits) != 1:
            which = f"{len(hits)} recordings match {part!r}" if part else f"there are {len(hits)} recordings"
            raise UserError(f"{which}: name one cell of {'; '.join(hits or recorded)}")
        return recorded[(exact or hits)[0]]

    def sweep(self) -> None:
        """Remove what runs that were killed left beside the cells."""
        for draft in (self.folder / "cells").glob(".*"):
            shutil.rmtree(draft, ignore_errors=True)

    def disparity(self, cell: Cell) -> dict[int, NDArray[np.float32]]:
        """View index -> (H, W) stored disparity map, pixels per view step.

        Raises
        ------
        ValueError, OSError
            If the file is missing or holds something else.
        """
        with np.load(self.cell(cell) / "disparity.npz", allow_pickle=False) as arrays:
            maps = {int(name.removeprefix("view_")): arrays[name] for name in arrays.files}
        if not maps or any(values.ndim != 2 or values.dtype != np.float32 for values in maps.values()):
            raise ValueError(f"{self.cell(cell) / 'disparity.npz'} holds no disparity maps")
        return maps

    def volume(self, cell: Cell) -> StoredVolume | None:
        """The stored volume, or None where there is none, or a damaged one."""
        try:
            return StoredVolume.read(self.cell(cell) / "volume.npz")
        except (ValueError, OSError):
            return None


def write_cell(
    draft: Path,
    cell: Cell,
    outcome: Outcome,
    disparity: Mapping[int, NDArray[np.float32]] | None = None,
    volume: StoredVolume | None = None,
) -> None:
    """Fill a cell's folder: its facts and, where it has them, its maps and its volume."""
    if volume is not None:
        volume.write(draft / "volume.npz")
    if disparity is not None:
        arrays: dict[str, Any] = {f"view_{view}": values for view, values in disparity.items()}
        np.savez_compressed(draft / "disparity.npz", **arrays)
    facts = {"cell": _json.unstructure(cell), "outcome": _json.unstructure(outcome)}
    text = json.dumps(facts, indent=1, allow_nan=False)
    (draft / "cell.json").write_text(text, encoding="utf-8")
