"""Curves of a run's sweeps, in a terminal and on the page: error against whatever took several numbers."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from matbench.reports.figures import INK, printable
from matbench.reports.tables import METRIC, label, metrics, regions
from matbench.reports.tables import text as shown
from matbench.statistics import FEW
from matbench.sweeps import Sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORDS = {
    "baseline": "baseline (view steps)",
    "bias": "bias of a camera (grey levels)",
    "blur": "blur (px)",
    "gain": "gain of a camera (share)",
    "highlight": "highlight (grey levels)",
    "misaligned": "vertical misalignment (px)",
    "n": "number of views",
    "noise": "noise (grey levels)",
    "views": "number of views",
    "vignetting": "vignetting (share)",
}
IN_TERMINAL = ("nonocc", "all", "occ")

# Okabe & Ito 2008: told apart by all kinds of eyes; the shapes of points tell them apart without colour
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_POINTS = ("o", "s", "^", "D", "v", "P")
_LINES = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))
_ACROSS = 3  # panels side by side


def title(sweep: Sweep) -> str:
    """What is swept and how far, and the setting of the scenes' other options."""
    what = f"{sweep.option} of {sweep.of}" if sweep.of else WORDS.get(sweep.option, sweep.option)
    what += f", {sweep.values[0]:g} to {sweep.values[-1]:g}"
    return f"{what}, scenes with {sweep.setting}" if sweep.setting else what


def caption(sweep: Sweep, metric: str = METRIC) -> str:
    """What the means are over, and what to beware of."""
    count = len(sweep.scenes)
    said = [f"Mean {metric} over the {_scenes(count)} with every value: {', '.join(sweep.scenes)}."]
    if not count:
        said = ["No scene has every value."]
    elif count < FEW:
        said.append(f"{'They are' if count > 1 else 'It is'} too few scenes for a band or a conclusion.")
    else:
        said.append("Bands and intervals: 95 % bootstrap over scenes; changes are paired by scene.")
    if sweep.left_out:
        said.append(f"Left out for want of a result: {', '.join(sweep.left_out)}.")
    moving = [region for region in sweep.moving if region in set(sweep.curves["region"])]
    if moving:
        said.append(f"Not the same pixels at every value: {', '.join(moving)}.")
    if sweep.limits:
        own = ", ".join(f"{name} {limit:g}" for name, limit in sweep.limits.items())
        said.append(f"Held by a parameter {sweep.option} of their own to: {own}.")
    return " ".join(said)


def _scenes(count: int) -> str:
    return f"{count} scene{'s' if count != 1 else ''}"


def _of(sweep: Sweep, metric: str) -> pd.DataFrame:
    """The rows of a metric, with the methods' labels."""
    rows = sweep.curves[sweep.curves["metric"] == metric]
    return rows.assign(method=[label(a, p) for a, p in zip(rows["algorithm"], rows["params"], strict=True)])


def lines(sweep: Sweep, metric: str = METRIC) -> pd.DataFrame:
    """One row for each region and method: what is shown, as texts.

    Columns: region, method, the values, then `change` from the first value to the last, its
    interval and verdict.
    """
    rows, out = _of(sweep, metric), []
    for region in regions(rows):
        for method, curve in rows[rows["region"] == region].groupby("method", sort=False):
            unit, last = str(curve["unit"].iloc[0]), curve.iloc[-1]
            interval = f"{last['change_low']:+.2f} .. {last['change_high']:+.2f}"
            out.append(
                {"region": region, "method": str(method)}
                | {f"{v:g}": shown(mean, unit) for v, mean in zip(curve["value"], curve["mean"], strict=True)}
                | {"change": f"{last['change']:+.2f}", "interval": interval if pd.notna(last["change_low"]) else "–"}
                | {"verdict": str(last["verdict"])}
            )
    heads = ["region", "method", *(f"{v:g}" for v in sweep.values), "change", "interval", "verdict"]
    return pd.DataFrame(out, columns=heads)


def terminal(sweeps: Sequence[Sweep], metric: str = METRIC) -> list[Table]:
    """A table for each sweep: its means in the regions of most interest."""
    out = []
    for sweep in sweeps:
        rows = lines(sweep, metric)
        rows = rows[rows["region"].isin(IN_TERMINAL)].drop(columns=["interval", "verdict"])
        if rows.empty:
            continue
        unit = metrics(sweep.curves).get(metric, "%")
        hint = "; too few scenes to conclude" if len(sweep.scenes) < FEW else ""
        head = f"{metric} ({unit}) against {title(sweep)}, mean over {_scenes(len(sweep.scenes))}{hint}"
        table = Table(title=Text(head), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
        for name in rows.columns:
            words = name in ("region", "method")
            table.add_column(Text(name), justify="left" if words else "right", overflow="fold", no_wrap=not words)
        for values in rows.to_numpy().tolist():
            table.add_row(*(Text(value) for value in values))
        out.append(table)
    return out


def figure(sweep: Sweep, metric: str = METRIC) -> "Figure | None":
    """A panel for each region with a curve for each method; None where nothing is known."""
    rows = _of(sweep, metric)
    names = regions(rows)
    if not names:
        return None
    from matplotlib.figure import Figure

    across = min(_ACROSS, len(names))
    down = -(-len(names) // across)
    drawn = Figure(figsize=(7.2, 0.4 + 1.95 * down), layout="constrained")
    grid = drawn.subplots(down, across, squeeze=False)
    for axes in grid.flat[len(names) :]:
        axes.set_axis_off()
    methods = [str(method) for method in rows["method"].unique()]
    for place, (name, axes) in enumerate(zip(names, grid.flat, strict=False)):
        here = rows[rows["region"] == name]
        _panel(axes, sweep, here, methods)
        count = int(here["scenes"].iloc[0])
        few = f" ({_scenes(count)})" if count != len(sweep.scenes) else ""
        axes.set_title(name + few, loc="left", fontsize=9, color=INK, parse_math=False)
        if place % across == 0:
            axes.set_ylabel(f"{metric}, {here['unit'].iloc[0]}" if here["unit"].iloc[0] else metric, color=INK)
        if place + across >= len(names):
            axes.set_xlabel(sweep.option if sweep.of else WORDS.get(sweep.option, sweep.option), color=INK)
    drawn.draw_without_rendering()
    for row in grid:
        last = [axes for axes in row if axes.axison][-1]
        _name_curves(last, methods, beside_nothing=last is row[-1])
    return drawn


def _panel(axes: "Axes", sweep: Sweep, rows: pd.DataFrame, methods: Sequence[str]) -> None:
    for index, method in enumerate(methods):
        curve = rows[rows["method"] == method]
        colour, point = _COLOURS[index % len(_COLOURS)], _POINTS[index % len(_POINTS)]
        line = _LINES[index // len(_COLOURS) % len(_LINES)]
        values = curve["value"].to_numpy(np.float64)
        axes.plot(values, curve["mean"], color=colour, marker=point, ms=4.5, lw=1.6, ls=line, mec=INK, mew=0.5)
        if curve["low"].notna().all() and len(curve):
            axes.fill_between(values, curve["low"], curve["high"], color=colour, alpha=0.15, lw=0)
    least, largest = sweep.values[0], sweep.values[-1]
    if least > 0 and largest > 50 * least:
        axes.set_xscale("log")
    if len(sweep.values) <= 8:
        axes.set_xticks(list(sweep.values), [f"{v:g}" for v in sweep.values])
        axes.minorticks_off()
    axes.set_ylim(bottom=min(0.0, float(rows["mean"].min())))
    axes.tick_params(colors=INK, labelsize=8)
    axes.grid(True, alpha=0.25, lw=0.6, color=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(INK)


def _name_curves(axes: "Axes", methods: Sequence[str], beside_nothing: bool) -> None:
    """Write each method's name at the end of its curve, moved apart where they would touch."""
    ends = []
    for method, line in zip(methods, axes.get_lines(), strict=True):
        x, y = (np.asarray(values, np.float64) for values in line.get_data())
        if len(x):
            height = float(axes.transData.transform([(x[-1], y[-1])])[0, 1])
            ends.append((height, (x[-1], y[-1]), line.get_color(), printable(method, 34)))
    step = 72 / axes.figure.dpi  # points in a dot
    ends.sort(key=lambda one: one[0])
    names = [name.replace("[", "\n[", 1) for *_, name in ends]
    rooms = [13 * (name.count("\n") + 1) for name in names]
    middles: list[float] = []
    for (height, *_), room in zip(ends, rooms, strict=True):  # upwards from the lowest
        floor = middles[-1] + (rooms[len(middles) - 1] + room) / 2 if middles else -np.inf
        middles.append(max(height * step, floor))
    ceiling = axes.bbox.y1 * step + 6
    for place in reversed(range(len(middles))):  # and down again from the panel's top
        middles[place] = min(middles[place], ceiling - rooms[place] / 2)
        ceiling = middles[place] - rooms[place] / 2
    for (height, end, colour, _), broken, middle in zip(ends, names, middles, strict=True):
        axes.annotate(
            broken,
            end,
            (14, middle - height * step),
            textcoords="offset points",
            va="center",
            fontsize=8,
            linespacing=1.3,
            color=INK,
            parse_math=False,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 1, "shrinkA": 1, "shrinkB": 3, "relpos": (0, 0.5)},
        ).set_in_layout(beside_nothing)
