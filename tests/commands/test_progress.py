"""Progress: what runs, what is left, in a few lines."""

import io

import pytest

from matbench.commands.console import Console
from matbench.commands.progress import SHOWN, Progress
from matbench.plans.plan import Cell, Method
from matbench.runs.outcome import Outcome


def cell(number: int, algorithm: str = "flat") -> Cell:
    return Cell(Method(algorithm, {}), f"synthetic/{'box' * 20}{number}", "", 0, f"{algorithm}{number}")


def shown(progress: Progress, width: int = 60) -> str:
    console = Console(width=width, file=io.StringIO(), record=True, no_color=True)
    console.print(progress._shown())
    return console.export_text()


def test_progress_names_what_runs_and_counts_what_is_left() -> None:
    now = [0.0]
    fast, slow = [cell(k) for k in range(6)], [cell(k, "slow") for k in range(2)]
    progress = Progress(None, [*fast, *slow], done=2, clock=lambda: now[0])
    assert "2/10 cells · getting ready" in shown(progress), "kernels may be compiled for long"
    progress("start", fast[0], None)
    assert "getting ready" not in shown(progress)
    progress("start", slow[0], None)  # several at once, as with --jobs
    assert progress.seconds_left() is None
    text = shown(progress)
    assert "2/10 cells" in text
    assert "left" not in text
    assert "flat on synthetic/box" in text
    assert "slow on synthetic/box" in text
    assert all(len(line) <= 60 for line in text.splitlines())
    now[0] = 3.0
    progress("done", fast[0], Outcome("ok", seconds=0.1))
    # one of slow runs for 3 s already and is taken to need the mean of what is known: 5 * 3 + 3, two at once
    assert progress.seconds_left() == pytest.approx((5 * 3 + 3) / 2)
    now[0] = 33.0
    progress("done", slow[0], Outcome("timeout", reason="took more than 30 s"))
    # five of 3 s and one of 33 s are waiting: two at once cannot be quicker than the longest
    assert progress.seconds_left() == pytest.approx(33)
    assert "4/10 cells · 1 failed · about 33 s left" in shown(progress, 70)
    narrow = Progress(Console(width=32, file=io.StringIO()), [*fast, *slow], clock=lambda: now[0])
    narrow._took["flat"] = [33.0]
    assert "0/8 cells · about 4 min left" in shown(narrow, 32), "the bar is shorter"
    for one in (*fast[1:], slow[1]):
        progress("start", one, None)
    assert len(progress._running) == 6
    for one in (*fast[1:], slow[1]):
        progress("done", one, Outcome("ok"))
    assert progress.seconds_left() == 0
    assert progress.done == progress.total == 10


def test_many_cells_at_once_stay_a_few_lines() -> None:
    many = [cell(k) for k in range(SHOWN + 5)]
    progress = Progress(None, many)
    for one in many:
        progress("start", one, None)
    lines = shown(progress).splitlines()
    assert len(lines) == SHOWN + 2
    assert lines[-1].strip() == "and 5 more"
