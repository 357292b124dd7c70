"""Progress of a run: which cells run now, how many are done and failed, and about how long the rest takes."""

import time
from collections.abc import Callable, Iterable, Sequence
from types import TracebackType

from attrs import define, field
from rich.console import Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from matbench.commands.console import Console
from matbench.plans.plan import Cell
from matbench.runs.outcome import FINAL, Outcome

SHOWN = 8  # running cells that are named; of the others the number is shown
_BAR = 24


@define(eq=False)
class Progress:
    """Shows progress: a live display in a terminal; elsewhere one line for each cell that ends.

    Parameters
    ----------
    console
        Where progress is shown; None for nowhere.
    todo
        The cells that will be computed.
    done
        How many cells of the plan are done already.
    clock
        A clock in seconds that never goes back.
    """

    console: Console | None
    todo: Sequence[Cell]
    done: int = 0
    clock: Callable[[], float] = time.monotonic
    failed: int = 0
    _running: dict[str, tuple[Cell, float]] = field(factory=dict)  # key -> cell, and when it started
    _waiting: dict[str, Cell] = field(init=False)
    _took: dict[str, list[float]] = field(factory=dict)
    _ended: set[str] = field(factory=set)
    _at_once: int = 1
    _live: Live | None = None

    def __attrs_post_init__(self) -> None:
        self._waiting = {cell.key: cell for cell in self.todo}

    def __enter__(self) -> "Progress":
        if self.console is not None and self.console.is_interactive and self.todo:
            self._live = Live(console=self.console, get_renderable=self._shown, refresh_per_second=4, transient=True)
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def __call__(self, event: str, cell: Cell, outcome: Outcome | None) -> None:
        """Take note that a cell starts or ends. Several may start before one ends."""
        if event == "start":
            self._waiting.pop(cell.key, None)
            if cell.key in self._ended:  # it is solved once more (`Settings.steady`)
                self.done -= 1
            self._running[cell.key] = (cell, self.clock())
            self._at_once = max(self._at_once, len(self._running))
        elif outcome is not None:
            self._waiting.pop(cell.key, None)
            if cell.key in self._running:
                _, began = self._running.pop(cell.key)
                self._took.setdefault(cell.method.algorithm, []).append(self.clock() - began)
            self.done += 1
            self._ended.add(cell.key)
            self.failed += outcome.status not in FINAL
            self._say(cell, outcome)

    def _say(self, cell: Cell, outcome: Outcome) -> None:
        if self.console is None or (self._live is not None and not outcome.reason):
            return  # whoever watches sees the counts; only what went wrong stays on the screen
        took = f" {outcome.seconds:.2f} s" if outcome.seconds is not None else ""
        reason = f" {outcome.reason}" if outcome.reason else ""
        total = str(self.total)
        self.console.say(f"{self.done:>{len(total)}}/{total} {outcome.status:>7}  {cell}{took}{reason}")

    @property
    def total(self) -> int:
        return self.done + len(self._running) + len(self._waiting)

    def seconds_left(self) -> float | None:
        """An estimate of the seconds left; None before the first cell has ended.

        A cell is expected to take the mean time of its method's earlier cells. A method without any is expected
        to take the mean of all methods.
        """
        if not self._took:
            return None
        means = {name: sum(took) / len(took) for name, took in self._took.items()}
        unknown, now = sum(means.values()) / len(means), self.clock()
        expected = [means.get(cell.method.algorithm, unknown) for cell in self._waiting.values()]
        for cell, began in self._running.values():
            expected.append(max(0.0, means.get(cell.method.algorithm, unknown) - (now - began)))
        return max(sum(expected) / self._at_once, max(expected, default=0.0))

    def _shown(self) -> Group:
        """A bar with the counts, then a line for each running cell, cut at the terminal's edge."""
        total = self.total
        said = [f"{self.done}/{total} cells"]
        if self.failed:
            said.append(f"{self.failed} failed")
        left = self.seconds_left()
        if left is not None:
            said.append(f"about {duration(left)} left")
        elif not self._running and not self._ended:  # kernels are compiled, keepers are started
            said.append("getting ready")
        text = " · ".join(said)
        head = Table.grid(padding=(0, 1))
        head.add_row(ProgressBar(total=max(total, 1), completed=self.done, width=self._bar(text)), _line(text))
        return Group(head, *_named(self._running.values(), self.clock()))

    def _bar(self, text: str) -> int:
        """Columns of the bar: in a narrow terminal the words beside it are worth more than its length."""
        room = _BAR if self.console is None else self.console.width - len(text) - 1
        return max(1, min(_BAR, room))


def _named(running: Iterable[tuple[Cell, float]], now: float) -> list[Text]:
    lines = [_line(f"  {duration(now - began):>6}  {cell}") for cell, began in running]
    more = len(lines) - SHOWN
    return [*lines[:SHOWN], _line(f"  and {more} more")] if more > 0 else lines


def _line(text: str) -> Text:
    return Text(text, no_wrap=True, overflow="ellipsis")


def duration(seconds: float) -> str:
    """A duration in words.

    >>> duration(4.2), duration(75), duration(7500)
    ('4 s', '1 min', '2 h 5 min')
    """
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
