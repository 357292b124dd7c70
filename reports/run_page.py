"""The page of a run: what it shows of the plan, the tables and the stored cells, and by what it is known to be old."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.measures.metrics import Better
from matbench.measures.volumes import StoredVolume
from matbench.plans import plugins
from matbench.plans.plan import Plan
from matbench.plans.record_option import MOST_ROWS
from matbench.plans.settings import Settings
from matbench.reports.tables import METRIC
from matbench.results import freshness
from matbench.results.scores import Tables
from matbench.runs import provenance
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scene import Scene

if TYPE_CHECKING:
    import pandas as pd

    from matbench.reports.published import Beside
    from matbench.results.sweeps import Sweep


@frozen(eq=False)
class RunPage:
    """``report.html`` of a run.

    Parameters
    ----------
    plan, store, scenes, settings, command, decision
        As of `matbench.prepared.Comparison`.
    metrics
        The metrics of the printed tables.
    remarks
        Remarks on the scenes, one line each.
    """

    plan: Plan
    store: Store
    scenes: Mapping[str, Scene]
    settings: Settings
    command: str
    decision: str
    metrics: tuple[str, ...]
    remarks: Sequence[str]

    def digest(self, is_ablation: bool) -> str:
        """Digest of the page that is there and of what it would be made from, tables aside; empty if none is there.

        Parameters
        ----------
        is_ablation
            Does it show an ablation?
        """
        return freshness.page_digest(self.store, self._asked(is_ablation))

    def write(
        self,
        tables: Tables,
        better: Mapping[str, Better],
        ablation: "pd.DataFrame | None" = None,
        sweeps: "Sequence[Sweep]" = (),
    ) -> Path:
        """Write it. Every map that it shows is read once more, because tables keep no maps.

        Parameters
        ----------
        better
            Metric -> which direction of it is better.
        """
        from matbench.reports import page

        stored = {(*c.method.names, c.scene, c.seed): c for c in self.plan.scored}
        path = self.store.folder / freshness.PAGE
        outcomes = {key: tables.outcomes.get(cell.key) for key, cell in stored.items()}

        def disparity(algorithm: str, params: str, scene: str, seed: int) -> NDArray[np.float32] | None:
            names = algorithm, params, scene, seed
            solved = self.store.read(stored[names], self.scenes[scene])
            # a picture of other maps than those that were scored would mislead
            return solved.maps.get(self.scenes[scene].ref) if solved.outcome == outcomes[names] else None

        def volume(algorithm: str, params: str, scene: str, seed: int) -> StoredVolume | None:
            outcome = outcomes[algorithm, params, scene, seed]
            kept = outcome is not None and outcome.has_volume
            return self.store.volume(stored[algorithm, params, scene, seed], self.scenes[scene]) if kept else None

        page.write_page(
            path,
            page.Report(
                title=self.store.folder.resolve().name,
                command=self.command,
                results=tables.results,
                cells=tables.cells,
                maps=disparity,
                scenes=self.scenes,
                facts=self._facts(tables),
                ablation=ablation,
                sweeps=tuple(sweeps),
                reliability=tables.reliability,
                sparsification=tables.sparsification,
                better=better,
                volumes=volume,
                histories={key: outcome.history for key, outcome in outcomes.items() if outcome is not None},
                parameters={c.method.names: c.method.params for c in self.plan.cells},
                groups={c.method.names[0]: plugins.groups(c.method.algorithm) for c in self.plan.cells},
                rows=self._rows(tables.outcomes.values()),
                beside=self.beside(tables),
                metric=self._first(better),
                decision=self.decision,
            ),
        )
        if (made := freshness.made(self.store)) is not None:
            evolve(made, page=self.digest(ablation is not None)).write(self.store)
        return path

    def _first(self, better: Mapping[str, Better]) -> str:
        """What the page ranks by: less of it must be better."""
        first = self.metrics[0]
        return first if better.get(first) == "lower" else METRIC

    def beside(self, tables: Tables) -> "Beside | None":
        """The published rows of the run's scenes beside its own, if they were asked for and anything has a score."""
        from matbench.reports import published

        if not self.settings.published or tables.results.empty:
            return None
        return published.beside(tables.results, tables.cells)

    def _rows(self, outcomes: Iterable[Outcome]) -> tuple[int, ...]:
        """The image rows whose epipolar slices the page shows: those asked for now, and those in the recordings."""
        options = [self.settings.record, *(outcome.recorded for outcome in outcomes)]
        return tuple(sorted({row for option in options if option is not None for row in option.rows})[:MOST_ROWS])

    def _asked(self, is_ablation: bool) -> list[object]:
        """All that changes the page, besides the tables and what they are made from."""
        rows = self.settings.record.rows if self.settings.record is not None else ()
        name, spellings = self.store.folder.resolve().name, dict(self.plan.spellings)
        more = [*(["published"] if self.settings.published else []), *([self.decision] if self.decision else [])]
        words = [self.command, name, list(rows), is_ablation, spellings, list(self.remarks), list(self.metrics)]
        return [*words, *more]

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
