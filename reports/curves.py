"""The curves of sweeps, in a terminal and on the page: error against an option that took several numbers."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from matbench.measures.statistics import FEW
from matbench.reports.page_figures import ACROSS, INK, dress, grid_of, line_style, name_curves
from matbench.reports.standing import verdict
from matbench.reports.tables import ASIDE, METRIC, aside_note, interval, label, metrics, regions
from matbench.reports.tables import text as shown
from matbench.results.comparable import is_enough
from matbench.results.sweeps import Sweep

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


def title(sweep: Sweep) -> str:
    """The title of a sweep: what is varied, its values, and the scenes' other options."""
    what = f"{sweep.option} of {sweep.of}" if sweep.of else WORDS.get(sweep.option, sweep.option)
    what += f", {sweep.values[0]:g} to {sweep.values[-1]:g}"
    return f"{what}, scenes with {sweep.setting}" if sweep.setting else what


def caption(sweep: Sweep, metric: str = METRIC) -> str:
    """What the means are taken over, and warnings."""
    count = len(sweep.scenes)
    said = [f"Mean {metric} over the {_scenes(count)} with every value: {', '.join(sweep.scenes)}."]
    if not count:
        said = ["No scene has every value."]
    elif count < FEW:
        said.append(f"{'They are' if count > 1 else 'It is'} too few scenes for a band or a conclusion.")
    else:
        said.append(
            "Bands and intervals: 95 % over scenes; changes are paired by scene, "
            "and verdicts corrected for all changes of a region (Holm)."
        )
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
    """The table of a sweep as texts: one row for each region and method.

    Columns: region, method, the values, then `change` from the first value to the last, its
    interval, how many scenes all this is over, and the verdict.
    """
    rows, out = _of(sweep, metric), []
    for region in regions(rows):
        for method, curve in rows[rows["region"] == region].groupby("method", sort=False):
            unit, last = str(curve["unit"].iloc[0]), curve.iloc[-1]
            out.append(
                {"region": region, "method": str(method)}
                | {
                    f"{v:g}": shown(mean, unit) + ("" if is_enough(over) else ASIDE)
                    for v, mean, over in curve[["value", "mean", "answered"]].to_numpy(float).tolist()
                }
                | {"change": shown(last["change"], "%", signed=True)}
                | {"interval": interval(last["change_low"], last["change_high"]), "scenes": str(last["scenes"])}
                | {"verdict": verdict(str(last["verdict"]), last["enough"])}
            )
    heads = ["region", "method", *(f"{v:g}" for v in sweep.values), "change", "interval", "scenes", "verdict"]
    return pd.DataFrame(out, columns=heads)


def terminal(sweeps: Sequence[Sweep], metric: str = METRIC) -> list[Table]:
    """A table for each sweep: the means in the regions of most interest."""
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
        if rows.map(lambda value: value.endswith(ASIDE)).any(axis=None):
            table.caption, table.caption_justify = Text(aside_note()), "left"
        out.append(table)
    return out


def figure(sweep: Sweep, metric: str = METRIC) -> "Figure | None":
    """A panel for each region, with a curve for each method; None if there are no numbers."""
    rows = _of(sweep, metric)
    names = regions(rows)
    if not names:
        return None
    drawn, grid = grid_of(len(names))
    methods = [str(method) for method in rows["method"].unique()]
    for place, (name, axes) in enumerate(zip(names, grid, strict=True)):
        here = rows[rows["region"] == name]
        _panel(axes, sweep, here, methods)
        count = int(here["scenes"].iloc[0])
        few = f" ({_scenes(count)})" if count != len(sweep.scenes) else ""
        axes.set_title(name + few, loc="left", fontsize=9, color=INK, parse_math=False)
        if place % ACROSS == 0:
            axes.set_ylabel(f"{metric}, {here['unit'].iloc[0]}" if here["unit"].iloc[0] else metric, color=INK)
        if place + ACROSS >= len(names):
            axes.set_xlabel(sweep.option if sweep.of else WORDS.get(sweep.option, sweep.option), color=INK)
    name_curves(drawn, methods)
    return drawn


def _panel(axes: "Axes", sweep: Sweep, rows: pd.DataFrame, methods: Sequence[str]) -> None:
    for index, method in enumerate(methods):
        curve = rows[rows["method"] == method]
        style = line_style(index)
        values = curve["value"].to_numpy(np.float64)
        axes.plot(values, curve["mean"], **style)
        if curve["low"].notna().all() and len(curve):
            axes.fill_between(values, curve["low"], curve["high"], color=style["color"], alpha=0.15, lw=0)
    least, largest = sweep.values[0], sweep.values[-1]
    if least > 0 and largest > 50 * least:
        axes.set_xscale("log")
    if len(sweep.values) <= 8:
        axes.set_xticks(list(sweep.values), [f"{v:g}" for v in sweep.values])
        axes.minorticks_off()
    axes.set_ylim(bottom=min(0.0, float(rows["mean"].min())))
    dress(axes)
