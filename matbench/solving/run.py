"""Working through a plan: each cell in a process of its own, results as they come."""

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from multiprocessing.connection import wait
from typing import Any, Literal

from matbench.plans import plugins
from matbench.plans.plan import Cell, Plan
from matbench.plans.settings import Settings
from matbench.runs.store import Outcome, Store, write_cell
from matbench.solving.environment import kernels_kept, without_main
from matbench.solving.keeper import Keeper, dismiss
from matbench.solving.worker import Job

Event = Literal["start", "done"]
Listener = Callable[[Event, Cell, Outcome | None], None]


def run(
    plan: Plan,
    store: Store,
    settings: Settings,
    todo: Sequence[Cell],
    preload: Iterable[str] = (),
    listen: Listener | None = None,
) -> None:
    """Compute cells of a plan.

    One cell at a time unless the settings say otherwise, so that seconds are comparable. Each is
    solved in a process that a keeper watches (`matbench.solving.keeper`), or on a cluster
    (`matbench.solving.cluster`); whatever a method does costs that cell alone. `KeyboardInterrupt` ends
    the cells under way and is passed on; what is finished stays.

    Raises
    ------
    FolderLost
        If cells cannot be written.

    Parameters
    ----------
    todo
        Those that are not done (`matbench.runs.todo`).
    preload
        Modules that are imported once for all cells, besides the harness, such as those of the methods.
    listen
        Told as each cell starts and ends.
    """
    told = listen or (lambda *_: None)

    def tell(event: Event, cell: Cell, outcome: Outcome | None) -> None:
        if outcome is not None and store.outcome(cell) != outcome:  # what was solved could not be kept
            store.try_out()
            with store.building(cell) as draft:
                write_cell(draft, cell, outcome)
                (draft / "log.txt").touch()
        told(event, cell, outcome)

    if not todo:
        return
    store.sweep()
    with without_main(), kernels_kept():
        if settings.dask is None:
            _here(plan, store, settings, preload, todo, tell)
        else:
            from matbench.solving import cluster

            cluster.work(plan, store, settings, todo, tell)


def _datasets(cells: Iterable[Cell]) -> list[str]:
    """The modules that load the cells' scenes."""
    known = plugins.installed("datasets")
    prefixes = dict.fromkeys(cell.scene.partition("/")[0] for cell in cells)
    entries = [known[prefix].entry for prefix in prefixes if prefix in known]
    return [entry.module for entry in entries if not isinstance(entry, type)]


def _here(
    plan: Plan, store: Store, settings: Settings, preload: Iterable[str], todo: Sequence[Cell], tell: Listener
) -> None:
    """Share out cells to keepers on this machine."""
    jobs = [
        Job(store.folder.resolve(), cell, plan.plugin_files, settings.threads_each(), settings, settings.jobs == 1)
        for cell in todo
    ]
    waiting = deque(jobs)
    preload = [*preload, *_datasets(job.cell for job in jobs)]
    free: list[Keeper] = []
    busy: dict[Any, tuple[Keeper, Job]] = {}
    try:
        free += [Keeper(preload) for _ in range(min(settings.jobs, len(jobs)))]
        while waiting or busy:
            while waiting and free:
                keeper, job = free.pop(), waiting.popleft()
                busy[keeper.line] = keeper, job
                keeper.take(job)
                tell("start", job.cell, None)
            for line in wait(list(busy)):
                keeper, job = busy[line]
                outcome, lives = keeper.done(job)
                if not lives:
                    dismiss([keeper])
                del busy[line]
                free.append(keeper if lives else Keeper(preload))
                tell("done", job.cell, outcome)
    finally:
        dismiss([*free, *(keeper for keeper, _ in busy.values())])
