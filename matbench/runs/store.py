"""A run on disk: plan, cells and tables. A cell is there whole, or it is not there."""

import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EEXIST, EISDIR, ELOOP, ENOENT, ENOTDIR, ENOTEMPTY
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.errors import LONGEST_NAME, UserError, cause, refuse_hidden
from matbench.files.documents import read_json
from matbench.files.plain import NotPlain, digest_plain, read_plain
from matbench.files.remarks import remark_once
from matbench.files.removal import remove
from matbench.files.writing import draft_folder, settle, write_text
from matbench.measures.volumes import StoredVolume
from matbench.plans.plan import Cell, Plan
from matbench.plans.request import LARGEST_SEED
from matbench.runs.cell_files import MOST_FACTS, Solved, maps_digest, read_maps, read_volume
from matbench.runs.cell_files import write_cell as write_cell  # its earlier place
from matbench.runs.lock import LOCK, WORK, locked
from matbench.runs.outcome import Outcome
from matbench.runs.stopped import Stopped
from matbench.safe_text import hidden_in, printable
from matbench.scene import Scene

KEY = re.compile(r"[0-9a-f]{16}")
"""What a cell's folder is called."""
_DRAFT = re.compile(r"\.([0-9a-f]{16}|removed)\.\w+")
_ABSENT = (ENOENT, ENOTDIR, EISDIR, ELOOP)  # no such file; after any other error there may well be one
_MOST_PLAN = 1 << 26  # bytes; some fifty thousand cells
_MOST_REPEATS = 1 << 20

_json = make_converter(detailed_validation=False)  # the first fault is enough: a plan may have a hundred thousand


def _to_disk(folder: Path) -> None:
    """Wait until a folder's files are on the disk. If they cannot be written, the error comes here and not later."""
    for path in [*folder.iterdir(), folder]:
        settle(path)


_TABLE_DRAFT = re.compile(
    r"\.(plan|scores|work|results|cells|changes|sweeps|ablation|reliability|sparsification|report)\.(json|csv|tex|html)\.\w+"
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
                if not settle(folder / "cells"):
                    remark_once(
                        f"the file system of {str(folder)!r} does not tell when files are safe on the disk: "
                        "after a power cut, finished cells may be lost"
                    )
        except OSError as error:
            raise UserError(f"output folder {str(folder)!r} cannot be used: {cause(error)}") from error
        return store

    def check(self, plan: Plan) -> None:
        """Raise what `open` raises for a folder that cannot hold a plan; nothing is written."""
        folder = self.folder
        refuse_hidden("output folder", str(folder))
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
        if len(text) > _MOST_PLAN:
            raise UserError(f"a plan of {len(plan.cells)} cells is too large: ask for less in one run")
        if not path.exists() or read_plain(path, most=_MOST_PLAN) != text.encode():
            write_text(path, text)
        (self.folder / "cells").mkdir(exist_ok=True)

    def _read(self, path: Path) -> dict[str, Any]:
        try:
            found = read_json(path, most=_MOST_PLAN)
        except OSError as error:
            raise UserError(f"{path} cannot be read: {cause(error)}; give a run folder") from error
        except NotPlain as error:
            raise UserError(f"{path} cannot be read: {error}; give a run folder") from error
        except ValueError as error:
            raise UserError(f"{path} is damaged: not JSON") from error
        if not isinstance(found, dict):
            raise UserError(f"{path} is damaged: not a JSON object")
        return found

    def request(self) -> Any:
        """What the run in this folder was asked for."""
        return self._read(self.folder / "plan.json").get("request")

    def command(self) -> str:
        """The line that asked for the run, if it is known."""
        return printable(str(self._read(self.folder / "plan.json").get("command", "")))

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
        names = [name for c in plan.cells for name in (str(c), c.method.algorithm, c.method.file, *c.method.params)]
        if any(map(hidden_in, (*names, *plan.plugin_files, *plan.spellings, *plan.spellings.values()))):
            raise UserError(f"{self.folder / 'plan.json'} is damaged: a name in it cannot be printed")
        parts = [
            p for c in plan.cells for m in (c.method,) for p in (m.algorithm, m.changed, m.file, *m.names, c.scene)
        ]
        if max(map(len, parts), default=0) > LONGEST_NAME:
            raise UserError(f"{self.folder / 'plan.json'} is damaged: a name in it is too long")
        if not all(0 <= c.seed <= LARGEST_SEED and 0 <= c.repeat <= _MOST_REPEATS for c in plan.cells):
            raise UserError(f"{self.folder / 'plan.json'} is damaged: a cell's seed or repeat cannot be right")
        return plan

    def cell(self, cell: Cell) -> Path:
        """Where a cell's files lie once it is done."""
        return self.folder / "cells" / cell.key

    def facts(self, cell: Cell) -> Any:
        """What ``cell.json`` holds, unchecked.

        Raises
        ------
        ValueError, OSError
            If it is missing, or no JSON.
        """
        return read_json(self.cell(cell) / "cell.json", most=MOST_FACTS)

    def outcome(self, cell: Cell) -> Outcome | None:
        """A cell's outcome, without a look at its maps. None if it is not computed, or ``cell.json`` is damaged.

        Raises
        ------
        FolderLost
            If the folder cannot be read, so that its content is unknown.
        """
        try:
            outcome = _json.structure(self.facts(cell)["outcome"], Outcome)
            return None if outcome.implausible else outcome
        except Exception as error:  # half a cell is no cell: it is computed anew
            self._check_readable(error)
            return None

    def read(self, cell: Cell, scene: Scene | None = None) -> Solved:
        """Read a cell with its maps and its confidence, and check both against their digests.

        The outcome is None if the cell is not computed, or its files are damaged.

        Parameters
        ----------
        scene
            What was solved, if it is known: maps and volumes of another size are not unpacked.

        Raises
        ------
        FolderLost
            If the folder cannot be read, so that its content is unknown.
        """
        outcome, place = self.outcome(cell), self.cell(cell)
        if outcome is None or outcome.status != "ok":
            return Solved(cell, outcome, place)
        try:
            maps = self.disparity(cell, scene)
        except Exception as error:  # half a cell is no cell: it is computed anew
            self._check_readable(error)
            return Solved(cell, None, place)
        if outcome.maps and maps_digest(maps) != outcome.maps:
            return Solved(cell, None, place, scene=scene)
        solved = Solved(cell, outcome, place, maps, scene)
        if outcome.confidence and not solved.confidence:
            return Solved(cell, None, place, scene=scene)
        return solved

    def _check_readable(self, error: Exception) -> None:
        """Raise FolderLost unless the error says that a file is missing or damaged."""
        if isinstance(error, OSError) and error.errno is not None and error.errno not in _ABSENT:
            raise Stopped.of(self.folder, error) from error

    def fingerprint(self, cell: Cell) -> str:
        """SHA-256 of a stored cell's facts, which hold the digest of its maps; empty if there is none."""
        try:
            return digest_plain(self.cell(cell) / "cell.json", most=MOST_FACTS)
        except (OSError, NotPlain):
            return ""

    def stale(self, plan: Plan) -> list[Cell]:
        """The stored cells that do not belong to the plan: those of other code, other pixels, other repeats.

        Of a run that grows, cells of scenes that it may still come to are none of these.
        """
        current = {cell.key for cell in plan.cells}
        known = {(str(cell.method), cell.method.code) for cell in plan.cells}
        found = []
        for path in sorted((self.folder / "cells").glob("*/cell.json")):
            if path.parent.name in current or not KEY.fullmatch(path.parent.name):
                continue
            try:
                cell = _json.structure(read_json(path, most=MOST_FACTS)["cell"], Cell)
            except Exception:  # whatever a damaged one raises  # noqa: S112
                continue
            is_to_come = cell.scene in plan.among and (str(cell.method), cell.method.code) in known
            if cell.key == path.parent.name and not is_to_come:
                found.append(cell)
        return found

    @contextmanager
    def building(self, cell: Cell) -> Iterator[Path]:
        """A draft folder for a cell. It becomes the cell's folder when the block ends; if the block fails, it goes."""
        draft = draft_folder(self.folder / "cells", cell.key)
        try:
            yield draft
            _to_disk(draft)
            self._place(draft, cell)
        finally:
            remove(draft)

    def _place(self, draft: Path, cell: Cell) -> None:
        for attempt in range(3):
            if os.path.lexists(self.cell(cell)):
                self.remove(cell)
            try:
                draft.replace(self.cell(cell))
            except OSError as error:  # somebody else's came in between
                if error.errno not in (ENOTEMPTY, EEXIST) or attempt == 2:
                    raise
            else:
                return

    def remove(self, cell: Cell) -> None:
        """Remove a cell in one step: its folder is moved aside before its files are deleted."""
        aside = draft_folder(self.folder / "cells", "removed")
        with suppress(FileNotFoundError):
            self.cell(cell).replace(aside / cell.key)
        remove(aside)

    def try_out(self) -> None:
        """Write a mebibyte and raise FolderLost if that fails: better before a long solve than after it."""
        try:
            with tempfile.TemporaryFile(dir=self.folder / "cells") as file:
                file.write(os.urandom(1 << 20))
                file.flush()
                settle(file.fileno())
        except OSError as error:
            raise Stopped.of(self.folder, error) from error

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
                remove(draft)
        for draft in self.folder.glob(".*.*.*"):
            if _TABLE_DRAFT.fullmatch(draft.name):
                with suppress(OSError):
                    draft.unlink()

    def disparity(self, cell: Cell, scene: Scene | None = None) -> dict[int, NDArray[np.float32]]:
        """View index -> (H, W) stored disparity map, pixels per view step; those of `scene`, if it is given.

        Raises
        ------
        ValueError, OSError
            If the file is missing or holds something else.
        """
        return read_maps(self.cell(cell) / "disparity.npz", None if scene is None else (scene.height, scene.width))

    def volume(self, cell: Cell, scene: Scene | None = None) -> StoredVolume | None:
        """The stored volume; None if there is none, it is damaged, or it is none of `scene`, if that is given."""
        return read_volume(self.cell(cell), scene)
