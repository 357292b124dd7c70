"""Does a method repeat itself? The same cell solved several times, each in a fresh process."""

from collections.abc import Iterable

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.plans.plan import Cell
from matbench.runs.cell_files import Solved
from matbench.runs.outcome import FINAL, Outcome


@frozen
class Repeats:
    """All solves of a cell that is solved several times.

    Parameters
    ----------
    asked, solved
        How many solves were asked for, and how many ended ``ok``.
    answers
        How many different answers there were: other maps, or another confidence.
    differ
        Share of the pixels at which some solve differs from the first.
    failed
        The first repeat that did not end well; None if all did.
    timed
        The solves whose seconds count: those that ended ``ok`` undisturbed, or all that ended ``ok`` if there are none.
    """

    cell: Cell
    asked: int
    solved: int
    answers: int
    differ: float = 0.0
    failed: tuple[Cell, Outcome] | None = None
    timed: tuple[Outcome, ...] = ()

    def __str__(self) -> str:
        if self.answers > 1:
            return f"differ: {self.answers} answers of {self.solved}"
        return f"same: {self.solved}" if self.solved == self.asked else f"{self.solved} of {self.asked}"

    @property
    def unsteady(self) -> str:
        """How its answers differ, as a line; empty if they do not."""
        if self.answers < 2:
            return ""
        differ = f"which differ in {100 * self.differ:.3g} % of the pixels" if self.differ else "of other confidence"
        return f"{self.cell}: {self.solved} solves gave {self.answers} answers, {differ}"


def judged(cell: Cell, asked: int, solves: Iterable[Solved]) -> Repeats:
    """Compare all solves of a cell. Only the maps of two solves are in memory at once."""
    first: Solved | None = None
    solved, answers, alike = 0, set[str](), ""
    timed: list[Outcome] = []
    failed: tuple[Cell, Outcome] | None = None
    unlike: NDArray[np.bool_] = np.zeros(1, np.bool_)  # pixel by pixel, of the maps of all views
    for one in solves:
        if one.outcome is None:
            continue
        solved += one.outcome.status == "ok"
        timed += [one.outcome] if one.outcome.status == "ok" and one.outcome.seconds is not None else []
        answers |= {one.outcome.answer} - {""}
        # a failure of the first solve is the status of the cell itself
        if one.cell.repeat and one.outcome.status not in FINAL and failed is None:
            failed = one.cell, one.outcome
        if one.maps and first is None:
            first = one
            alike = one.outcome.maps
        elif one.maps and first is not None and one.outcome.maps != alike:  # equal digests need no look at pixels
            unlike = unlike | _unlike(first, one)
    timed = [outcome for outcome in timed if outcome.alone and not outcome.doubt] or timed
    return Repeats(cell, asked, solved, len(answers), float(unlike.mean()), failed, tuple(timed))


def _unlike(one: Solved, other: Solved) -> NDArray[np.bool_]:
    """(pixels of all views,) where the maps of two solves differ; (1,) true if their sizes differ."""
    a, b = (np.concatenate([values.ravel() for _, values in sorted(cell.maps.items())]) for cell in (one, other))
    return ~((a == b) | (np.isnan(a) & np.isnan(b))) if a.shape == b.shape else np.ones(1, np.bool_)
