"""The progress of a run, read from its folder alone; also while another process works on it."""

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import mean

from attrs import frozen

from matbench.plans.plan import Cell, Plan
from matbench.results import freshness
from matbench.runs.lock import Work, is_locked, locked
from matbench.runs.outcome import FINAL, Outcome
from matbench.runs.store import Store


@frozen
class Standing:
    """The progress of a run.

    Parameters
    ----------
    cells
        How many cells the plan has.
    counts
        Status -> how many cells ended so.
    running
        The cells under way, each with the seconds since it started.
    work
        Who works on it; None if nobody does.
    left
        How many cells are not done: under way, never computed, or not ended well.
    seconds_left
        A rough guess from finished cells of the same methods; None if some method has no finished cell.
    stale
        How many stored cells do not belong to the plan, such as those of code that has changed since.
    stale_bytes
        How many bytes the stale cells take on the disk.
    tables
        Why the tables cannot be relied on; empty if they can.
    """

    folder: Path
    cells: int
    counts: Mapping[str, int]
    running: Sequence[tuple[Cell, float]] = ()
    work: Work | None = None
    left: int = 0
    seconds_left: float | None = None
    stale: int = 0
    stale_bytes: int = 0
    tables: str = ""

    @property
    def failed(self) -> int:
        """How many cells did not end well."""
        return sum(count for status, count in self.counts.items() if status not in FINAL)


def standing(folder: Path) -> Standing:
    """Read the progress of a run from its folder. Nothing is written.

    Raises
    ------
    UserError
        If it holds no run.
    """
    store = Store(folder)
    plan = store.plan()
    outcomes = {cell.key: store.outcome(cell) for cell in plan.cells}
    # a killed process leaves its facts behind; they are true only while the lock is held
    work = Work.read(folder) if is_locked(folder) else None
    now = time.time()
    begun = work.running if work else {}
    running = [(cell, max(0.0, now - begun[cell.key])) for cell in plan.cells if cell.key in begun]
    # a cell that is solved once more still has the outcome of the time before
    undone = [cell for cell in plan.cells if cell.key in begun or not _is_done(outcomes[cell.key])]
    stale = store.stale(plan)
    return Standing(
        folder,
        len(plan.cells),
        dict(Counter(o.status for key, o in outcomes.items() if o is not None and key not in begun)),
        running,
        work,
        len(undone),
        _guess(plan, outcomes, undone, {cell.key: spent for cell, spent in running}),
        len(stale),
        sum(path.lstat().st_size for cell in stale for path in store.cell(cell).rglob("*")),
        freshness.fault(plan, store, outcomes),
    )


def prune(folder: Path) -> int:
    """Remove the stored cells that do not belong to the plan, and return how many there were.

    Raises
    ------
    UserError
        If the folder holds no run, or a process works on it.
    """
    store = Store(folder)
    store.check_place()
    plan = store.plan()
    with locked(folder):
        stale = store.stale(plan)
        for cell in stale:
            store.remove(cell)
    return len(stale)


def _is_done(outcome: Outcome | None) -> bool:
    return outcome is not None and outcome.status in FINAL


def _guess(
    plan: Plan, outcomes: Mapping[str, Outcome | None], undone: Sequence[Cell], spent: Mapping[str, float]
) -> float | None:
    """Seconds left, if each cell takes the mean time of its method's finished cells, or else of its algorithm's."""
    took: dict[str, list[float]] = {}
    for cell in plan.cells:
        outcome = outcomes[cell.key]
        if outcome is not None and outcome.seconds is not None:
            for name in (str(cell.method), cell.method.algorithm):
                took.setdefault(name, []).append(outcome.seconds + (outcome.warmup_seconds or 0))
    total = 0.0
    for cell in undone:
        known = took.get(str(cell.method)) or took.get(cell.method.algorithm)
        if known is None:
            return None
        total += max(0.0, mean(known) - spent.get(cell.key, 0.0))
    return total / max(1, len(spent))  # as many cells at once as run now
