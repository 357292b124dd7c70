"""Computing the cells of a plan: each in a process of its own, here or on a cluster."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from multiprocessing.connection import wait
from types import MappingProxyType
from typing import Any, Literal

from attrs import evolve

from matbench.files import temporary
from matbench.plans import plugins
from matbench.plans.plan import Cell, Plan
from matbench.plans.settings import Settings
from matbench.runs.cell_files import write_cell
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scene import Scene
from matbench.solving import strays
from matbench.solving.compile_ahead import Ahead
from matbench.solving.environment import kernel_cache_in_use, without_main
from matbench.solving.keeper import LOOK, Keeper, dismiss
from matbench.solving.ready_views import ReadyViews
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
    scenes: Mapping[str, Scene] = MappingProxyType({}),
    ahead: Ahead | None = None,
) -> None:
    """Compute cells of a plan.

    One cell runs at a time unless the settings say otherwise: only then are seconds comparable. Each cell
    is solved in a process that a keeper watches (`matbench.solving.keeper`), or on a cluster
    (`matbench.solving.cluster`), so a method that crashes or hangs costs one cell and no other.
    `KeyboardInterrupt` ends the running cells and is passed on; finished cells stay.

    Parameters
    ----------
    todo
        Those that are not done (`matbench.runs.todo`).
    preload
        Modules to import once for all cells besides the harness, such as those of the methods.
    listen
        Called as each cell starts and ends.
    scenes
        Those that are in memory already, by name: their views are handed to the keepers, which read others themselves.
    ahead
        The methods that are being compiled: it is waited for before the first cell.

    Raises
    ------
    FolderLost
        If cells cannot be written.
    """
    told = listen or (lambda *_: None)
    known = {cell.key: store.fingerprint(cell) for cell in plan.cells}

    def tell(event: Event, cell: Cell, outcome: Outcome | None) -> None:
        if outcome is not None and store.outcome(cell) != outcome:
            # the cell's folder holds something else: the outcome was never written there (crash, full disk, cluster)
            store.try_out()
            with store.building(cell) as draft:
                write_cell(draft, cell, outcome)
        if outcome is not None:
            known[cell.key] = store.fingerprint(cell)
        told(event, cell, outcome)

    if not todo:
        return
    strays.end_of_the_dead()
    temporary.sweep()
    store.sweep()
    try:
        with without_main(), kernel_cache_in_use():
            if settings.dask is not None:
                from matbench.solving import cluster

                cluster.run_cells(plan, store, settings, todo, tell)
                return
            if ahead is not None:
                ahead.wait()
            _run_here(plan, store, settings, preload, todo, tell, scenes)
            if settings.steady:
                doubtful = [cell for cell in todo if (found := store.outcome(cell)) is not None and found.is_doubtful]
                _run_here(plan, store, evolve(settings, jobs=1), preload, doubtful, tell, scenes)
    finally:
        _refuse_changed(plan, store, known)


def _refuse_changed(plan: Plan, store: Store, known: Mapping[str, str]) -> None:
    """Have the cells count as failed that are not as they were stored: a method has reached into the run folder.

    Where methods find it read-only (`matbench.solving.confinement`), there are none.
    """
    changed = Outcome("failed", reason="its files were changed by a method after it was solved")
    for cell in plan.cells:
        if store.fingerprint(cell) != known[cell.key]:
            with store.building(cell) as draft:
                write_cell(draft, cell, changed)


def _dataset_modules(cells: Iterable[Cell]) -> list[str]:
    """The modules of the datasets that load the cells' scenes."""
    known = plugins.installed("datasets")
    prefixes = dict.fromkeys(cell.scene.partition("/")[0] for cell in cells)
    entries = [known[prefix].entry for prefix in prefixes if prefix in known]
    return [entry.module for entry in entries if not isinstance(entry, type)]


def _run_here(
    plan: Plan,
    store: Store,
    settings: Settings,
    preload: Iterable[str],
    todo: Sequence[Cell],
    tell: Listener,
    scenes: Mapping[str, Scene],
) -> None:
    """Solve cells on this machine, as many at once as the settings say."""
    jobs = [
        Job(store.folder.resolve(), cell, plan.plugin_files, settings.threads_each(), settings, settings.jobs == 1)
        for cell in todo
    ]
    waiting = deque(jobs)
    preload = [*preload, *_dataset_modules(job.cell for job in jobs)]
    # a keeper lives through many cells: starting one takes longer than solving a small scene
    free: list[Keeper] = []
    busy: dict[Any, tuple[Keeper, Job]] = {}
    places = ExitStack()
    try:
        ready = ReadyViews(places.enter_context(temporary.temporary_folder()), scenes, todo)
        free += [Keeper(preload) for _ in range(min(settings.jobs, len(jobs)))]
        while waiting or busy:
            while waiting and free:
                keeper, job = free.pop(), waiting.popleft()
                job = evolve(job, views=ready.of(job.cell))
                busy[keeper.line] = keeper, job
                keeper.begin(job)
                tell("start", job.cell, None)
            heard = wait(list(busy), LOOK)
            for line, (keeper, job) in list(busy.items()):
                if line not in heard and not keeper.is_lost():
                    continue
                outcome, lives = keeper.outcome(job)
                if not lives:  # it was killed itself, by the system for want of memory, say
                    dismiss([keeper])
                del busy[line]
                free.append(keeper if lives else Keeper(preload))
                ready.done(job.cell)
                tell("done", job.cell, outcome)
    finally:
        dismiss([*free, *(keeper for keeper, _ in busy.values())])
        places.close()
