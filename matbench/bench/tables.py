"""The tables of `matbench bench`, for the terminal and, in Markdown, for a job summary."""

from collections.abc import Mapping, Sequence
from math import isnan

import pandas as pd
from attrs import frozen
from rich import box
from rich.table import Table as RichTable
from rich.text import Text

from matbench.bench.base import Versus
from matbench.bench.baselines import Judged
from matbench.bench.compilation import Compilation
from matbench.bench.measuring import Timing


@frozen
class Table:
    """A table of texts. The first `words` columns are aligned left, the others, numbers, right. Notes come below."""

    title: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    notes: tuple[str, ...] = ()

    def rich(self) -> RichTable:
        """The table for the terminal."""
        table = RichTable(title=Text(self.title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
        table.padding, table.pad_edge, table.show_edge = (0, 1, 0, 0), False, False
        for number, head in enumerate(self.heads):
            table.add_column(head, justify="left" if number < self.words else "right", no_wrap=number == 0)
        for row in self.rows:
            table.add_row(*(Text(cell, style="bold red" if "slower" in row else "") for cell in row))
        return table

    def markdown(self) -> str:
        """The table for a job summary."""
        rows = [[cell.replace("|", "\\|") for cell in row] for row in self.rows]
        sides = ["left"] * self.words + ["right"] * (len(self.heads) - self.words)
        body = pd.DataFrame(rows, columns=list(self.heads)).to_markdown(
            index=False, disable_numparse=True, colalign=sides
        )
        return f"**{self.title}**\n\n{body}\n" + "".join(f"\n{note}\n" for note in self.notes)


def seconds(value: float) -> str:
    """A time with its unit, such as ``12.3 ms``."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value * 1e9:.3g} ns"


def _number(value: float, places: str = ".3f") -> str:
    return "" if isnan(value) else format(value, places)


def _reach(timing: Timing | None) -> str:
    """Half the width of the interval, as a share of the ratio."""
    return "" if timing is None else f"{(timing.high - timing.low) / (2 * timing.ratio):.1%}"


def judged(results: Sequence[Judged]) -> Table:
    """The times, judged by the stored ratios."""
    rows = tuple(
        (
            one.name,
            one.verdict,
            seconds(one.timing.seconds) if one.timing else "",
            _number(one.ratio, ".4g"),
            _reach(one.timing),
            _number(one.ratio / one.stored - 1, "+.1%"),
            _number(one.against.ratio - 1, "+.1%") if one.against else "",
        )
        for one in results
    )
    heads = "subject", "verdict", "time", "refs", "+-", "change", "in turns"
    notes = tuple(f"{one.name} failed: {one.reason}" for one in results if one.reason)
    return Table("Processor time, in references (refs), against what is stored", heads, rows, 2, notes)


def compared(results: Sequence[Versus], margin: float, base: str) -> Table:
    """The times of the working tree compared with those of a base."""
    rows = tuple(
        (
            one.name,
            one.verdict(margin),
            _number(one.ratio),
            "" if isnan(one.low) else f"{one.low:.3f} .. {one.high:.3f}",
        )
        for one in results
    )
    heads = "subject", "verdict", "time, here / base", "95 % interval"
    notes = tuple(f"{one.name} not compared: {one.reason}" for one in results if one.reason)
    return Table(f"Working tree against {base}", heads, rows, 2, notes)


def compiled(found: Compilation, stored: float | None, ratio: float) -> Table:
    """The times of compilation; the last line has the sum and the stored one."""
    parts = [(name, seconds(took), _number(took / found.reference, ".1f"), "") for name, took in found.seconds.items()]
    total = ("all", seconds(sum(found.seconds.values())), f"{ratio:.1f}", "" if stored is None else f"{stored:.1f}")
    heads = "first solve, beyond those above", "CPU time", "references", "stored"
    return Table("Compilation, without any cached kernel", heads, (*parts, total))


def counters(work: Mapping[str, Mapping[str, int]]) -> Table:
    """The counters of work."""
    rows = tuple(
        (name, ", ".join(f"{key} {count:,}" for key, count in counts.items())) for name, counts in work.items()
    )
    return Table("Work, exactly", ("method", "counters"), rows, 2)
