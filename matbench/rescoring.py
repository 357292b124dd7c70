"""Scoring runs on disk again, and joining runs. No method runs, and only plug-in files that are given are read."""

import shlex
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from attrs import evolve, field, frozen

from matbench.comparison import Comparison
from matbench.errors import UserError
from matbench.plans import plugins
from matbench.plans.plan import Cell, Method, Plan
from matbench.plans.settings import Settings
from matbench.results import archive, scores
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scene import Scene
from matbench.scenes.catalogue import data_root, load_scene


@frozen(eq=False)
class Scenes:
    """The scenes of a plan: those that are on this machine and unchanged, and those that are not.

    Parameters
    ----------
    found
        Name -> scene.
    missing
        Name -> why it cannot be used, in words.
    """

    found: Mapping[str, Scene] = field(factory=dict)
    missing: Mapping[str, str] = field(factory=dict)

    @classmethod
    def of(cls, plan: Plan, data: Path | None) -> "Scenes":
        found, missing = {}, {}
        for name, digest in {cell.scene: cell.scene_digest for cell in plan.cells}.items():
            try:
                scene = load_scene(name, data)
            except UserError as error:
                missing[name] = f"it is not here: {error}"
                continue
            if scene.digest == digest:
                found[name] = scene
            else:
                missing[name] = "it is not the one that was solved: its pixels, views or range have changed"
        return cls(found, missing)


def open_run(
    folder: Path, data: str | Path | None = None, partial: bool = False, plugin: Sequence[Path] = ()
) -> tuple[Comparison, Mapping[str, str]]:
    """Open a run on disk as the comparison that `matbench.comparison.prepare` made.

    Parameters
    ----------
    partial
        Leave out the scenes that are missing or have changed, and metrics that are not installed.
    plugin
        The users' own files that are read. Files that only the run names are not: it may come from anywhere.

    Returns
    -------
    The comparison, and left-out scene -> reason.

    Raises
    ------
    UserError
        If the folder holds no run, or scenes or metrics are missing and `partial` is not given.
    """
    with plugins.using(plugin):
        return _open_run(folder, data, partial)


def _open_run(folder: Path, data: str | Path | None, partial: bool) -> tuple[Comparison, Mapping[str, str]]:
    store, root = Store(folder), data_root(data)
    store.check_place()
    plan = store.plan()
    unread = [file for file in plan.plugin_files if Path(file) not in plugins.used()]
    files = f"; --plugin reads {shlex.join(unread)} or another file that has it" if unread else ""
    scenes = Scenes.of(plan, root)
    if scenes.missing and not (partial and scenes.found):
        said = "; ".join(f"{name}: {why}" for name, why in scenes.missing.items())
        hint = files + ("" if partial or not scenes.found else "; --partial scores the other scenes")
        raise UserError(f"{len(scenes.missing)} of {len(scenes.missing) + len(scenes.found)} scenes: {said}{hint}")
    lacking = lost_metrics(store.folder / "results.csv")
    if lacking and not partial:
        hint = files or "; --plugin reads a file that has it"
        raise UserError(
            f"nothing offers {', '.join(lacking)} of {store.folder / 'results.csv'}{hint}; --partial goes on without"
        )
    kept = tuple(cell for cell in plan.cells if cell.scene in scenes.found)
    spellings = {name: of for name, of in plan.spellings.items() if of in scenes.found}
    settings = Settings(data=root)
    return Comparison(
        evolve(plan, cells=kept, spellings=spellings),
        store,
        scenes.found,
        settings,
        store.command(),
        files=plugins.used(),
    ), scenes.missing


def lost_metrics(table: Path) -> list[str]:
    """The metrics in a run's table that are found neither in installed plug-ins nor in the files in use."""
    try:
        named = pd.read_csv(table, usecols=["metric"], dtype=str)["metric"].dropna().unique()
    except (OSError, ValueError):  # there is none, or a damaged one, which is made anew
        return []
    known = {metric.name for metric in scores.metrics()}
    return [name for name in named if name not in known]


def join(folders: Sequence[Path], out: Path) -> Store:
    """Join several runs into one, in a new folder. Cells that are in several runs are taken once.

    Raises
    ------
    UserError
        If they do not belong in one table: a scene of the same name has other pixels, a method of the same
        name has other code, or the same cell has other maps.
    """
    stores = [Store(folder) for folder in folders]
    for store in stores:
        store.check_place()
    plans = [store.plan() for store in stores]
    chosen: dict[str, tuple[Cell, Store, Outcome | None]] = {}
    scenes: dict[str, tuple[str, Store]] = {}
    codes: dict[str, tuple[Method, Store]] = {}
    for store, plan in zip(stores, plans, strict=True):
        for cell in plan.cells:
            digest, other = scenes.setdefault(cell.scene, (cell.scene_digest, store))
            if digest != cell.scene_digest:
                raise _unlike(cell.scene, "is another scene (pixels, views or range)", store, other)
            method, other = codes.setdefault(str(cell.method), (cell.method, store))
            if (method.code, method.params) != (cell.method.code, cell.method.params):
                raise _unlike(str(cell.method), "has other code or parameters", store, other)
            mine = store.read(cell).outcome
            _, other, theirs = chosen.setdefault(cell.key, (cell, store, mine))
            if mine and theirs and mine.maps != theirs.maps and {mine.status, theirs.status} == {"ok"}:
                raise _unlike(str(cell), "has other maps, so that method does not repeat itself", store, other)
            if mine and (theirs is None or theirs.status != "ok"):
                chosen[cell.key] = cell, store, mine
    spellings = {name: of for plan in plans for name, of in plan.spellings.items()}
    files = tuple(dict.fromkeys(file for plan in plans for file in plan.plugin_files))
    joined = Store.open(
        out, Plan(tuple(cell for cell, *_ in chosen.values()), files, spellings), " + ".join(map(str, folders))
    )
    for cell, store, outcome in chosen.values():
        if outcome is not None:
            with joined.building(cell) as draft:
                for path in archive.files_of(store, cell):
                    shutil.copyfile(path, draft / path.name, follow_symlinks=False)
    return joined


def _unlike(name: str, what: str, one: Store, other: Store) -> UserError:
    return UserError(f"{name} {what} in {str(one.folder)!r} than in {str(other.folder)!r}: one table cannot hold both")
