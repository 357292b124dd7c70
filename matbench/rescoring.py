"""Scoring runs on disk again, and joining runs. No method runs, and only plug-in files that are given are read."""

import json
import shlex
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from attrs import evolve, field, frozen

from matbench.errors import UserError
from matbench.files.csv_tables import most_bytes, read_csv
from matbench.plans import plugins
from matbench.plans.plan import Cell, Method, Plan
from matbench.plans.settings import Settings
from matbench.prepared import Comparison
from matbench.results import archive, metric_catalogue
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scene import Scene
from matbench.scenes.catalogue import data_root, load_scene
from matbench.scenes.scene_check import beyond_range
from matbench.shelf import Shelf


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
        files = plugins.used()
        found, missing = Shelf(lambda name: load_scene(name, data, files or None)), dict[str, str]()
        for name, digest in {cell.scene: cell.scene_digest for cell in plan.cells}.items():
            try:
                scene = load_scene(name, data)
            except UserError as error:
                missing[name] = f"it is not here: {error}"
                continue
            if scene.digest == digest:
                found.put(scene, beyond_range(scene) or "")
            else:
                missing[name] = "it is not the one that was solved: its pixels, views or range have changed"
        return cls(found, missing)


def open_run(
    folder: Path,
    data: str | Path | None = None,
    partial: bool = False,
    plugin: Sequence[Path] = (),
    metrics: Sequence[str] = (),
) -> tuple[Comparison, Mapping[str, str]]:
    """Open a run on disk as the comparison that `matbench.comparison.prepare` made.

    Parameters
    ----------
    partial
        Leave out the scenes that are missing or have changed, and metrics that are not installed.
    plugin
        The users' own files that are read. Files that only the run names are not: it may come from anywhere.
    metrics
        Names of metrics to compute besides those that the run's table has.

    Returns
    -------
    The comparison, and left-out scene -> reason.

    Raises
    ------
    UserError
        If the folder holds no run, or scenes or metrics are missing and `partial` is not given.
    """
    with plugins.using(plugin):
        return _open_run(folder, data, partial, metrics)


def _open_run(
    folder: Path, data: str | Path | None, partial: bool, metrics: Sequence[str]
) -> tuple[Comparison, Mapping[str, str]]:
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
    measured = measured_metrics(store.folder / "results.csv", len(plan.cells))
    lacking = [name for name in measured if not _is_offered(name)]
    if lacking and not partial:
        hint = files or "; --plugin reads a file that has it"
        raise UserError(
            f"nothing offers {', '.join(lacking)} of {store.folder / 'results.csv'}{hint}; --partial goes on without"
        )
    kept = tuple(cell for cell in plan.cells if cell.scene in scenes.found)
    spellings = {name: of for name, of in plan.spellings.items() if of in scenes.found}
    settings = Settings(data=root, metrics=metrics)
    return Comparison(
        evolve(plan, cells=kept, spellings=spellings),
        store,
        scenes.found,
        settings,
        store.command(),
        files=plugins.used(),
        measured=tuple(name for name in measured if name not in lacking),
    ), scenes.missing


def measured_metrics(table: Path, cells: int) -> list[str]:
    """The names of the metrics in the table of a run of so many cells."""
    try:
        return [name for name in read_csv(table, ["metric"], most_bytes(cells))["metric"].unique() if name]
    except (OSError, ValueError):  # there is none, or a damaged one, which is made anew
        return []


def _is_offered(metric: str) -> bool:
    """Do installed plug-ins, or the files in use, offer a metric of that very name?"""
    try:
        return metric_catalogue.metric_named(metric).name == metric
    except UserError:
        return False


def mirror(folder: Path, place: Path) -> Path:
    """A new folder `place` in which tables of a run can be made that is not to be written: its cells are linked."""
    store = Store(folder)
    store.check_place()
    (place / "cells").mkdir(parents=True)
    _copy(archive.tables_of(store), place)
    for cell in store.plan().cells:
        if store.cell(cell).is_dir() and not store.cell(cell).is_symlink():
            (place / "cells" / cell.key).symlink_to(store.cell(cell).resolve())
    return place


def join(folders: Sequence[Path], out: Path, labels: Mapping[Path, str] = {}) -> Store:
    """Join several runs into one in a new folder, or copy one with its tables. A cell of several runs is taken once.

    Parameters
    ----------
    labels
        Folder -> its label: its methods whose code is other than that of the runs without one are called
        ``NAME (LABEL)``.

    Raises
    ------
    UserError
        If they do not belong in one table: a scene of the same name has other pixels, a method of the same
        name has other code, or the same cell has another answer; or if a label is for no method.
    """
    folders = sorted(folders, key=labels.__contains__)  # those without a label first
    stores = [Store(folder) for folder in folders]
    for store in stores:
        store.check_place()
    named: dict[tuple[str, str, str], Method] = {}
    plans = [_named(store.plan(), named, labels.get(store.folder, ""), store) for store in stores]
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
                hint = "; a label tells them apart, as in 'RUN as before'"
                raise _unlike(str(cell.method), "has other code or parameters", store, other, hint)
            mine = store.read(cell).outcome
            _, other, theirs = chosen.setdefault(cell.key, (cell, store, mine))
            if mine and theirs and {mine.status, theirs.status} == {"ok"} and mine.answer != theirs.answer:
                raise _unlike(str(cell), "has another answer, so that method does not repeat itself", store, other)
            if mine and (theirs is None or theirs.status != "ok"):
                chosen[cell.key] = cell, store, mine
    spellings = {name: of for plan in plans for name, of in plan.spellings.items()}
    files = tuple(dict.fromkeys(file for plan in plans for file in plan.plugin_files))
    command = stores[0].command() if len(stores) == 1 else " + ".join(map(str, folders))
    joined = Store.open(out, Plan(tuple(cell for cell, *_ in chosen.values()), files, spellings), command)
    for cell, store, outcome in chosen.values():
        if outcome is not None:
            with joined.building(cell) as draft:
                _copy(archive.files_of(store, cell), draft)
    if len(stores) == 1:
        _copy([path for path in archive.tables_of(stores[0]) if path.name != "plan.json"], out)
    return joined


def _named(plan: Plan, named: dict[tuple[str, str, str], Method], label: str, store: Store) -> Plan:
    """A plan whose methods are called as the same ones of the plans before it are, else by its label if it has one.

    Parameters
    ----------
    named
        Algorithm, parameters and code -> the method as it is called; those of this plan are added.
    """
    cells, is_labelled = [], False
    for cell in plan.cells:
        method = cell.method
        which = method.algorithm, json.dumps(dict(method.params), sort_keys=True), method.code
        if which not in named and label:
            method, is_labelled = evolve(method, label=f"{method.names[0]} ({label})", shown=method.names[1]), True
        cells.append(evolve(cell, method=named.setdefault(which, method)))
    if label and not is_labelled:
        raise UserError(f"label {label!r} is for no method: all of {str(store.folder)!r} have the same code elsewhere")
    return evolve(plan, cells=tuple(cells))


def _copy(paths: Iterable[Path], place: Path) -> None:
    for path in paths:
        shutil.copyfile(path, place / path.name, follow_symlinks=False)


def _unlike(name: str, what: str, one: Store, other: Store, hint: str = "") -> UserError:
    folders = f"in {str(one.folder)!r} than in {str(other.folder)!r}"
    return UserError(f"{name} {what} {folders}: one table cannot hold both{hint}")
