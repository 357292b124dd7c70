"""A whole comparison: choose methods and scenes, run, score, report. This module puts the parts together."""

import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench import spec
from matbench.errors import UserError
from matbench.files.writing import write_text
from matbench.measures.prediction import instead_of_truth
from matbench.measures.volumes import StoredVolume
from matbench.plans import plugins
from matbench.plans.plan import Cell, Plan, make_plan, methods
from matbench.plans.record_option import MOST_ROWS, RecordOption
from matbench.plans.request import seeds_of
from matbench.plans.settings import Settings
from matbench.results import freshness, scores
from matbench.results.scores import Tables
from matbench.runs import provenance
from matbench.runs.lock import locked
from matbench.runs.outcome import Outcome
from matbench.runs.store import FolderLost, Store
from matbench.runs.todo import Todo, pending
from matbench.scene import NotInScene, Scene
from matbench.scenes.catalogue import Selection, data_root, default_scenes, is_pattern, load_scene, select
from matbench.scenes.scene_check import beyond_range
from matbench.solving import run

if TYPE_CHECKING:
    import pandas as pd

    from matbench.results.sweeps import Sweep

RUNS = Path("runs")


@frozen(eq=False)
class Comparison:
    """A plan with its scenes in memory and its folder on disk, ready to run or to look at.

    Parameters
    ----------
    scenes
        Name -> scene with its truth, for every scene of the plan.
    command
        The command line that asked for the comparison, for the report.
    left_out
        Reason -> scenes that a pattern matches but that cannot be compared.
    files
        Users' own files that may be read, for their scenes and metrics. A file that the plan names is read only if
        it is also here: a run folder may come from anywhere, and could name any file.
    """

    plan: Plan
    store: Store
    scenes: Mapping[str, Scene]
    settings: Settings
    command: str
    left_out: Mapping[str, Sequence[str]] = {}
    files: tuple[Path, ...] = ()

    @property
    def folder(self) -> Path:
        return self.store.folder

    @property
    def remarks(self) -> list[str]:
        """Remarks on the scenes for readers of the scores, one line each."""
        return [f"{name}: {said}" for name, scene in self.scenes.items() if (said := beyond_range(scene))]

    def pending(self) -> Todo:
        """The cells to compute, found by reading every stored cell. Hold the run's lock until they are used."""
        return pending(self.plan, self.store, self.settings)

    def run(self, listen: run.Listener | None = None, todo: Todo | None = None) -> None:
        """Compute what is not done yet.

        Parameters
        ----------
        todo
            The result of `pending`, if the caller has held the run's lock since. By default it is found here.

        Raises
        ------
        FolderLost
            If the run folder cannot be used any more.
        UserError
            If another process works on it.
        """
        tell = listen or (lambda *_: None)
        names = {cell.method.algorithm for cell in self.plan.cells}
        found = plugins.algorithms([Path(file) for file in self.plan.plugin_files])
        entries = [found[name].entry for name in sorted(names)]
        preload = [entry.module for entry in entries if not isinstance(entry, type)]
        with locked(self.folder) as work, provenance.commit_known():

            def listening(event: run.Event, cell: Cell, outcome: Outcome | None) -> None:
                if event == "start":
                    work.start(cell.key)
                else:
                    work.end(cell.key)
                tell(event, cell, outcome)

            try:
                self.store.write_plan(self.plan)
                left = (todo or self.pending()).cells
                run.run(self.plan, self.store, self.settings, left, preload, listening)
            except OSError as error:
                raise FolderLost.of(self.folder, error) from error

    def tables(self) -> Tables:
        """Score the stored maps; write ``results.csv`` and ``cells.csv``, and ``reliability.csv`` if it has rows."""
        with plugins.using(self.files):
            return self._tables()

    def _tables(self) -> Tables:
        with locked(self.folder):
            found = scores.tables(self.plan, self.store, self.scenes)
            self.store.sweep()
            for name, table in (("results.csv", found.results), ("cells.csv", found.cells)):
                write_text(self.folder / name, table.to_csv(index=False))
            if len(found.reliability):
                write_text(self.folder / "reliability.csv", found.reliability.to_csv(index=False))
            else:
                (self.folder / "reliability.csv").unlink(missing_ok=True)
            made = freshness.Made.now(self.plan, self.store, self.scenes, found.outcomes)
            evolve(made, unsteady=found.unsteady).write(self.store)
        return found

    def kept(self, todo: Todo, is_ablation: bool = False) -> Tables | None:
        """The tables in the run folder, if they and the report are what would be made now; else None.

        Parameters
        ----------
        todo
            The result of `pending`, from just now.
        is_ablation
            Does the report show an ablation?
        """
        if todo.cells or len(todo.outcomes) < len(self.plan.cells):
            return None
        found = freshness.made(self.store)
        if found is None or not found.page:
            return None
        with plugins.using(self.files):
            now = freshness.Made.now(self.plan, self.store, self.scenes, todo.outcomes)
        page = freshness.page_digest(self.store, self._asked(is_ablation))
        if found != evolve(now, unsteady=found.unsteady, page=page):
            return None
        self.store.sweep()
        return scores.read(self.folder, found.unsteady, todo.outcomes)

    def sweeps(self, results: "pd.DataFrame") -> "list[Sweep]":
        """The curves over all options and parameters that take several numbers; written to ``sweeps.csv`` if any."""
        from matbench.results.sweeps import sweeps, table

        found = sweeps(self.plan, results)
        if found:
            write_text(self.folder / "sweeps.csv", table(found).to_csv(index=False))
        return found

    def ablation(self, results: "pd.DataFrame") -> "pd.DataFrame":
        """The effect of each factor; also written to ``ablation.csv`` and ``ablation.tex``."""
        from matbench.reports import switches
        from matbench.results.ablation import ablation

        table = ablation(self.plan, results)
        write_text(self.folder / "ablation.csv", table.to_csv(index=False))
        write_text(self.folder / "ablation.tex", switches.latex(table))
        return table

    def report(self, tables: Tables, ablation: "pd.DataFrame | None" = None, sweeps: "Sequence[Sweep]" = ()) -> Path:
        """Write ``report.html``. Every map that it shows is read once more, because tables keep no maps."""
        from matbench.reports import page

        stored = {(c.method.algorithm, c.method.changed, c.scene, c.seed): c for c in self.plan.scored}
        path = self.folder / freshness.PAGE
        with plugins.using(self.files):
            better = {m.name: m.better for m in scores.metrics()}
        outcomes = {key: tables.outcomes.get(cell.key) for key, cell in stored.items()}

        def disparity(algorithm: str, params: str, scene: str, seed: int) -> NDArray[np.float32] | None:
            names = algorithm, params, scene, seed
            solved = self.store.read(stored[names])
            # a picture of other maps than those that were scored would mislead
            return solved.maps.get(self.scenes[scene].ref) if solved.outcome == outcomes[names] else None

        def volume(algorithm: str, params: str, scene: str, seed: int) -> StoredVolume | None:
            outcome = outcomes[algorithm, params, scene, seed]
            kept = outcome is not None and outcome.has_volume
            return self.store.volume(stored[algorithm, params, scene, seed]) if kept else None

        page.write_page(
            path,
            page.Report(
                title=self.folder.resolve().name,
                command=self.command,
                results=tables.results,
                cells=tables.cells,
                maps=disparity,
                scenes=self.scenes,
                facts=self._facts(tables),
                ablation=ablation,
                sweeps=tuple(sweeps),
                reliability=tables.reliability,
                better=better,
                volumes=volume,
                histories={key: outcome.history for key, outcome in outcomes.items() if outcome is not None},
                parameters={(c.method.algorithm, c.method.changed): c.method.params for c in self.plan.cells},
                groups={c.method.algorithm: plugins.groups(c.method.algorithm) for c in self.plan.cells},
                rows=self._rows(tables.outcomes.values()),
            ),
        )
        if (made := freshness.made(self.store)) is not None:
            drawn = freshness.page_digest(self.store, self._asked(ablation is not None))
            evolve(made, page=drawn).write(self.store)
        return path

    def _rows(self, outcomes: Iterable[Outcome]) -> tuple[int, ...]:
        """The image rows whose epipolar slices the page shows: those asked for now, and those in the recordings."""
        options = [self.settings.record, *(outcome.recorded for outcome in outcomes)]
        return tuple(sorted({row for option in options if option is not None for row in option.rows})[:MOST_ROWS])

    def _asked(self, is_ablation: bool) -> list[object]:
        """All that changes the page, besides the tables and what they are made from."""
        rows = self.settings.record.rows if self.settings.record is not None else ()
        name, spellings = self.folder.resolve().name, dict(self.plan.spellings)
        return [self.command, name, list(rows), is_ablation, spellings, list(self.remarks)]

    def _facts(self, found: Tables) -> dict[str, str]:
        """What the cells ran on. Each cell has facts of its own: a run may be continued on another machine."""
        from matbench.reports import costs

        outcomes = [found.outcomes[cell.key] for cell in self.plan.cells if cell.key in found.outcomes]
        threads = [{"threads": str(o.threads)} for o in outcomes if o.threads]
        seeds = {"seeds": ", ".join(str(seed) for seed in self.plan.request["seeds"]), "scorer": freshness.digest()}
        facts = {**provenance.combined([*(o.ran_on for o in outcomes), *threads]), **seeds}
        if found.unsteady:
            facts["not repeatable"] = "; ".join(found.unsteady)
        if note := costs.timing_note(found.cells):
            facts["times"] = note
        if self.remarks:
            facts["ranges"] = "; ".join(self.remarks)
        return facts


def prepare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    settings: Settings = Settings(),
    out: str | Path | None = None,
    seed: int | Sequence[int] = 0,
    plugin: str | Path | Sequence[str | Path] = (),
    command: str | None = None,
    repeats: int = 1,
    write: bool = True,
) -> Comparison:
    """Check everything that was asked for, read every scene, and only then write the plan.

    Parameters are those of `compare`; without `write` not even the plan is written.
    """
    files = [Path(file).resolve() for file in ([plugin] if isinstance(plugin, str | Path) else plugin)]
    with plugins.using(files):
        return _prepare(algorithms, scenes, settings, out, seed, files, command, repeats, write)


def _prepare(
    algorithms: str | Sequence[str] | None,
    scenes: str | Sequence[str] | None,
    settings: Settings,
    out: str | Path | None,
    seed: int | Sequence[int],
    files: Sequence[Path],
    command: str | None,
    repeats: int,
    write: bool,
) -> Comparison:
    """`prepare`, within the block in which users' own scenes are found."""
    if not 1 <= repeats <= 100:
        raise UserError(f"repeats {repeats} is not a whole number from 1 to 100")
    rows = settings.record.rows if settings.record is not None else ()
    seeds = seeds_of(seed)
    own = [p.name for file in files for p in plugins.from_file(file).values()]
    chosen = methods(algorithms if algorithms is not None else [*plugins.default_algorithms(), *own], files)
    root = data_root(settings.data)
    selected = select(scenes, root) if scenes is not None else Selection(tuple(default_scenes(root)[0]))
    if not chosen or not selected.names:
        raise UserError("nothing to compare: name at least one algorithm and one scene")
    named = {str(one) for one in spec.expand(scenes or ()) if not is_pattern(one.name)}
    loaded: dict[tuple[str, str], Scene] = {}  # a scene spelled in two ways is one scene
    spellings: dict[str, str] = {}
    left_out = {reason: list(names) for reason, names in selected.left_out.items()}
    for name in selected.names:
        try:
            scene = load_scene(name, root)
        except NotInScene:
            if name in named:
                raise
            left_out.setdefault("the scenes have not these views", []).append(name)
            continue
        if scene.ref not in scene.truth and scene.held_out is None:
            ref = scene.labels[scene.ref]
            raise UserError(
                f"{name} has no ground truth of its reference view {ref}: it needs {instead_of_truth(scene)}"
            )
        for row in rows:
            if not 0 <= row < scene.height:
                raise UserError(f"row {row} of {name}: 0 to {scene.height - 1} is possible")
        kept = loaded.setdefault((scene.digest, scene.truth_digest), scene)
        if kept.name != scene.name:
            spellings[scene.name] = kept.name
    if not loaded:
        raise UserError(f"no scene has the views asked for: {', '.join(selected.names)}")
    by_name = {scene.name: scene for scene in loaded.values()}
    if len(by_name) < len(loaded):
        twice = next(name for name in by_name if sum(scene.name == name for scene in loaded.values()) > 1)
        raise UserError(f"two different scenes are called {twice}: scores of both cannot stand in one table")
    plan = make_plan(chosen, by_name, seeds, files, spellings, repeats)
    folder = Path(out) if out is not None else RUNS / plan.digest
    said = command if command is not None else shlex.join(["matbench", *sys.argv[1:]])
    if write:
        store = Store.open(folder, plan, said)
    else:
        store = Store(folder)
        store.check(plan)
    return Comparison(plan, store, by_name, evolve(settings, data=root), said, left_out, tuple(files))


def compare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    data: str | Path | None = None,
    out: str | Path | None = None,
    record: bool | RecordOption = False,
    volumes: bool = False,
    seed: int | Sequence[int] = 0,
    plugin: str | Path | Sequence[str | Path] = (),
    row: int | Sequence[int] | None = None,
    repeats: int = 1,
    settings: Settings = Settings(),
) -> "pd.DataFrame":
    """Run methods on scenes and score them; the run folder stays for `matbench view` and the report.

    Parameters
    ----------
    algorithms
        Selectors such as ``"sgbm"`` or ``"materiality[pairs=all,consecutive]"``; all built-in
        methods, and those of `plugin`, if not given.
    scenes
        Selectors such as ``"synthetic/*"`` or ``"middlebury2003/teddy[views=0:9:2]"``; the
        default synthetic scenes (box, curved, weak) and the paper's three where they are present, if not given.
    data
        The folder of real scenes; by default the one that MATBENCH_DATA names, else the user's data folder.
    out
        The run folder; ``runs/<digest of the request>`` if not given. A folder that holds the
        same request is resumed.
    record
        Also write a rerun recording of every cell, from a second, untimed solve. True records everything; a
        `RecordOption` chooses.
    volumes
        Also keep the volume of every cell whose method has one, and score it.
    seed
        One seed or several.
    plugin
        Python files that hold further methods, scenes and metrics.
    row
        The image row whose epipolar slices recordings show, or several; the middle one if not given.
    repeats
        How often every cell is solved; more than once shows whether a method repeats itself.
    settings
        Limits, how many cells run at once, a cluster, which cells to run. Parameters of this function override it.

    Returns
    -------
    DataFrame
        ``results.csv``: one row for each method, scene, seed, region and metric.

    Raises
    ------
    UserError
        If anything that was asked for is impossible. Nothing is written then.
    """
    wanted = record if isinstance(record, RecordOption) else RecordOption() if record else settings.record
    if wanted is not None and row is not None:
        wanted = evolve(wanted, rows=[row] if isinstance(row, int) else row)
    comparison = prepare(
        algorithms,
        scenes,
        settings=evolve(
            settings,
            data=Path(data) if data is not None else settings.data,
            record=wanted,
            volumes=volumes or settings.volumes,
        ),
        out=out,
        seed=seed,
        plugin=plugin,
        command="matbench.compare(...)",
        repeats=repeats,
    )
    with locked(comparison.folder):
        todo = comparison.pending()
        comparison.run(todo=todo)
        tables = comparison.kept(todo)
        if tables is None:
            tables = comparison.tables()
            comparison.report(tables, sweeps=comparison.sweeps(tables.results))
    return tables.results
