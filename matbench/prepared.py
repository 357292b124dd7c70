"""A comparison that is ready: its plan, its scenes and its folder, to be run, scored and reported."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import evolve, frozen

from matbench.files.csv_tables import csv_text
from matbench.files.writing import write_text
from matbench.measures.benchmarks import set_named
from matbench.measures.metrics import Better
from matbench.plans import plugins
from matbench.plans.plan import Cell, Plan
from matbench.plans.settings import Settings
from matbench.reports.run_page import RunPage
from matbench.reports.tables import METRIC
from matbench.results import freshness, metric_catalogue, scores
from matbench.results.scores import Tables
from matbench.runs import provenance
from matbench.runs.lock import locked
from matbench.runs.outcome import Outcome
from matbench.runs.stopped import Stopped
from matbench.runs.store import Store
from matbench.runs.todo import Todo, pending
from matbench.scene import Scene
from matbench.scenes.scene_check import beyond_range
from matbench.shelf import Shelf, facts_of
from matbench.solving import run
from matbench.solving.compile_ahead import Ahead

if TYPE_CHECKING:
    import pandas as pd

    from matbench.results.changes import Shared
    from matbench.results.sweeps import Sweep


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
    measured
        Metrics that the run's tables had before: they are computed again.
    decision
        How a run ended that grew until a difference was decided, for the report.
    ahead
        The methods that are being compiled for it, if there are any.
    """

    plan: Plan
    store: Store
    scenes: Mapping[str, Scene]
    settings: Settings
    command: str
    left_out: Mapping[str, Sequence[str]] = {}
    files: tuple[Path, ...] = ()
    measured: tuple[str, ...] = ()
    decision: str = ""
    ahead: Ahead | None = None

    @property
    def folder(self) -> Path:
        return self.store.folder

    @property
    def remarks(self) -> list[str]:
        """Remarks on the scenes for readers of the scores, one line each."""
        if isinstance(self.scenes, Shelf):
            return [f"{name}: {known.remark}" for name, known in self.scenes.facts.items() if known.remark]
        return [f"{name}: {said}" for name, scene in self.scenes.items() if (said := beyond_range(scene))]

    @cached_property
    def metrics(self) -> tuple[str, ...]:
        """The metrics of the printed tables; the first is what methods are ranked by.

        Those asked for. If none are, what the scenes' benchmark reports, if all of them are of the same one.
        """
        named = {known.metrics for known in facts_of(self.scenes).values()}
        of_all = named.pop() if len(named) == 1 else ""
        return self.settings.metrics or (set_named(of_all).metrics if of_all else (METRIC,))

    @cached_property
    def further(self) -> tuple[str, ...]:
        """The metrics that are computed besides those of every run: `metrics`, and those of the scenes' benchmarks."""
        named = dict.fromkeys(known.metrics for known in facts_of(self.scenes).values() if known.metrics)
        every = [*self.metrics, *self.measured, *(name for of in named for name in set_named(of).metrics)]
        always = {metric.name for metric in metric_catalogue.wanted()}
        return tuple(name for name in dict.fromkeys(every) if name not in always)

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
        Stopped
            If the system refuses what the run needs, such as the run folder (`FolderLost`).
        UserError
            If another process works on it.
        """
        tell = listen or (lambda *_: None)
        names = {cell.method.algorithm for cell in self.plan.cells if not cell.method.file}
        found = plugins.algorithms([Path(file) for file in self.plan.plugin_files])
        entries = [found[name].entry for name in sorted(names)]
        preload = [entry.module for entry in entries if not isinstance(entry, type)]
        with self._compiled(), locked(self.folder) as work, provenance.commit_known():

            def listening(event: run.Event, cell: Cell, outcome: Outcome | None) -> None:
                if event == "start":
                    work.start(cell.key)
                else:
                    work.end(cell.key)
                tell(event, cell, outcome)

            try:
                self.store.write_plan(self.plan)
                left = (todo or self.pending()).cells
                run.run(self.plan, self.store, self.settings, left, preload, listening, self.scenes, self.ahead)
            except OSError as error:
                raise Stopped.of(self.folder, error) from error

    @contextmanager
    def _compiled(self) -> Iterator[None]:
        """After this block nothing is compiled any more."""
        try:
            yield
        finally:
            if self.ahead is not None:
                self.ahead.stop()

    def tables(self) -> Tables:
        """Score the stored maps; write ``results.csv`` and ``cells.csv``, and the tables of curves that have rows."""
        with plugins.using(self.files):
            return self._tables()

    def _tables(self) -> Tables:
        with locked(self.folder):
            found = scores.tables(self.plan, self.store, self.scenes, self.further)
            self.store.sweep()
            for name, table in (("results.csv", found.results), ("cells.csv", found.cells)):
                write_text(self.folder / name, csv_text(table))
            for name, curves in (("reliability.csv", found.reliability), ("sparsification.csv", found.sparsification)):
                if len(curves):
                    write_text(self.folder / name, csv_text(curves))
                else:
                    (self.folder / name).unlink(missing_ok=True)
            made = freshness.Made.now(self.plan, self.store, self.scenes, found.outcomes, self.further)
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
            now = freshness.Made.now(self.plan, self.store, self.scenes, todo.outcomes, self.further)
        page = self.page.digest(is_ablation)
        if found != evolve(now, unsteady=found.unsteady, page=page, ended=found.ended):
            return None
        self.store.sweep()
        try:
            return scores.read(self.folder, found.unsteady, todo.outcomes)
        except ValueError:  # no run writes such tables: they are made anew
            return None

    def sweeps(self, results: "pd.DataFrame") -> "list[Sweep]":
        """The curves over all options and parameters that take several numbers; written to ``sweeps.csv`` if any."""
        from matbench.results.sweeps import sweeps, table

        found = sweeps(self.plan, results)
        if found:
            write_text(self.folder / "sweeps.csv", csv_text(table(found)))
        return found

    def ablation(self, results: "pd.DataFrame") -> "pd.DataFrame":
        """The effect of each factor; also written to ``ablation.csv`` and ``ablation.tex``."""
        from matbench.reports import switches
        from matbench.results.ablation import ablation

        table = ablation(self.plan, results)
        write_text(self.folder / "ablation.csv", csv_text(table))
        write_text(self.folder / "ablation.tex", switches.latex(table))
        return table

    def shared_with(self, run: Path) -> "Shared":
        """What an earlier run shares with this one.

        Raises
        ------
        UserError
            If it is no run, its tables are stale, or it shares no method or no scene with this one.
        """
        from matbench.results.changes import shared

        return shared(self.plan, self.folder, self.scenes, run)

    def changes(self, results: "pd.DataFrame", run: Path) -> "tuple[pd.DataFrame, pd.DataFrame]":
        """What has changed since an earlier run, cell by cell, and on average; the former is written, ``changes.csv``.

        Raises
        ------
        UserError
            As `shared_with`.
        """
        from matbench.reports.run_tables import read_run
        from matbench.results.changes import changes, effects

        both = self.shared_with(run)
        before, _ = read_run(run)
        found = changes(results[results["scene"].isin(both.scenes)], before, both.methods)
        write_text(self.folder / "changes.csv", csv_text(found))
        return found, effects(found, self._better())

    @property
    def page(self) -> RunPage:
        """The page of the run."""
        return RunPage(
            self.plan, self.store, self.scenes, self.settings, self.command, self.decision, self.metrics, self.remarks
        )

    def report(self, tables: Tables, ablation: "pd.DataFrame | None" = None, sweeps: "Sequence[Sweep]" = ()) -> Path:
        """Write ``report.html``. Every map that it shows is read once more, because tables keep no maps."""
        return self.page.write(tables, self._better(), ablation, sweeps)

    def _better(self) -> dict[str, Better]:
        """Metric -> which direction of it is better."""
        with plugins.using(self.files):
            return {metric.name: metric.better for metric in metric_catalogue.wanted(self.further)}
