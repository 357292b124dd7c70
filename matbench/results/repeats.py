"""Does a method repeat itself? The same cell solved several times, each in a fresh process."""

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from matbench.plans.plan import Cell, Plan
from matbench.runs.store import FINAL, Outcome, Store


@frozen
class Repeats:
    """What became of a cell that is solved several times.

    Parameters
    ----------
    asked, solved
        How often it is solved in all, and how often it has been.
    answers
        How many different maps there were.
    differ
        Share of a map's pixels that are not always the same.
    failed
        A repeat that did not end well, if one did not.
    """

    cell: Cell
    asked: int
    solved: int
    answers: int
    differ: float = 0.0
    failed: tuple[Cell, Outcome] | None = None

    def __str__(self) -> str:
        if self.answers > 1:
            return f"differ: {self.answers} answers of {self.solved}"
        return f"same: {self.solved}" if self.solved == self.asked else f"{self.solved} of {self.asked}"


def repeats(plan: Plan, store: Store) -> dict[str, Repeats]:
    """Key of each cell that is solved several times -> what came of it."""
    groups: dict[tuple[object, ...], list[Cell]] = {}
    for cell in plan.cells:
        groups.setdefault(cell.question[:-1], []).append(cell)
    return {cells[0].key: _judged(cells, store) for cells in groups.values() if len(cells) > 1}


def unsteady(plan: Plan, store: Store) -> list[str]:
    """The cells whose repeats differ, a line each."""
    return [
        f"{found.cell}: {found.solved} solves gave {found.answers} answers, "
        f"which differ in {100 * found.differ:.3g} % of the pixels"
        for found in repeats(plan, store).values()
        if found.answers > 1
    ]


def _judged(cells: Sequence[Cell], store: Store) -> Repeats:
    done = [(cell, outcome) for cell in cells if (outcome := store.outcome(cell)) is not None]
    ok = [cell for cell, outcome in done if outcome.status == "ok"]
    answers = {outcome.maps for _, outcome in done if outcome.maps}
    failed = next(((c, o) for c, o in done if c.repeat and o.status not in FINAL), None)
    share = _share(ok, store) if len(answers) > 1 else 0.0
    return Repeats(cells[0], len(cells), len(ok), len(answers), share, failed)


def _share(cells: Sequence[Cell], store: Store) -> float:
    """Share of pixels, of the maps of all views, that are not the same in all cells."""
    first, *rest = (np.concatenate([m.ravel() for _, m in sorted(store.disparity(c).items())]) for c in cells)
    if any(other.shape != first.shape for other in rest):
        return 1.0
    unlike = [~((first == other) | (np.isnan(first) & np.isnan(other))) for other in rest]
    return float(np.any(unlike, axis=0).mean())
