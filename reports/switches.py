"""The effect of each switch of a method, in a terminal, on the page and in LaTeX."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from matbench.reports.page_figures import INK
from matbench.reports.paper import tabular, tex
from matbench.reports.standing import verdict
from matbench.reports.tables import EFFECT, METRIC, REGIONS, interval, share, text
from matbench.results.comparable import SILENT

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _of(ablation: pd.DataFrame, metric: str, regions: Sequence[str]) -> pd.DataFrame:
    """The rows of a metric, switch by switch, regions in the order given."""
    shown = ablation[(ablation["metric"] == metric) & ablation["region"].isin(regions)]
    place = {region: i for i, region in enumerate(regions)}
    switch = shown.groupby(["algorithm", "factor", "level"], sort=False).ngroup()
    order = shown.assign(switch=switch, place=shown["region"].map(place)).sort_values(["switch", "place"])
    return shown.loc[order.index]


def lines(ablation: pd.DataFrame, metric: str = METRIC) -> pd.DataFrame:
    """The table as texts: one row for each algorithm, factor, level and region.

    Columns: switch, region, change, interval, size, scenes, verdict; changes in the metric's unit.
    """
    shown = _of(ablation, metric, REGIONS)
    several = ablation["algorithm"].nunique() > 1
    rows = [
        {
            "switch": f"{row['algorithm'] + ': ' if several else ''}{row['factor']} {row['base']} → {row['level']}",
            "region": row["region"],
            "change": text(row["change"], "%", signed=True),
            "interval": interval(row["low"], row["high"]),
            "size": text(row["effect_size"], EFFECT, signed=True),
            "scenes": str(row["scenes"]),
            "verdict": verdict(row["verdict"], row["enough"])
            + (f" ({share(row['answered'])})" if row["verdict"] == SILENT else ""),
        }
        for row in shown.to_dict("records")
    ]
    return pd.DataFrame(rows, columns=["switch", "region", "change", "interval", "size", "scenes", "verdict"])


def terminal(ablation: pd.DataFrame, metric: str = METRIC) -> list[Table]:
    """A table for each switch: the mean changes of one metric, with their intervals over scenes."""
    units = ablation.loc[ablation["metric"] == metric, "unit"]
    unit = f" ({units.iloc[0]})" if len(units) else ""
    out = []
    for switch, rows in lines(ablation, metric).groupby("switch", sort=False):
        title = Text(f"{switch}: change of {metric}{unit}")
        table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
        for head in rows.columns[1:]:
            table.add_column(head, justify="left" if head in ("region", "verdict") else "right")
        for values in rows.to_numpy().tolist():
            table.add_row(*(Text(value) for value in values[1:]))
        out.append(table)
    return out


def latex(ablation: pd.DataFrame, metric: str = METRIC) -> str:
    """The same numbers as a LaTeX table (package booktabs)."""
    table = lines(ablation, metric).drop(columns="size")
    for name in ("switch", "region", "verdict"):
        table[name] = table[name].map(tex)
    for name in ("change", "interval"):
        table[name] = table[name].str.replace("-", "$-$").str.replace("–", "--")
    body = tabular(list(table.columns), table.to_numpy().tolist(), "llrrrl")
    return f"% {metric}: mean change, 95 % interval over scenes\n{body}\n"


def forest(ablation: pd.DataFrame, metric: str = METRIC) -> "Figure | None":
    """A forest plot: for each switch and region the mean change and its interval; None if there are none."""
    shown = _of(ablation, metric, ("nonocc", "all", "occ"))
    if not len(shown):
        return None
    from matplotlib.figure import Figure

    rows: list[Any] = shown.to_dict("records")
    figure = Figure(figsize=(7.2, 0.9 + 0.26 * len(shown)), layout="constrained")
    axes = figure.subplots()
    places = range(len(shown))[::-1]
    for place, row in zip(places, rows, strict=True):
        if row["low"] == row["low"]:
            ends = [row["low"], row["high"]]
            axes.plot(ends, [place, place], color="#3b78c3", lw=2, solid_capstyle="butt")
        axes.plot([row["change"]], [place], marker="o", ms=6, color="#3b78c3", mec=INK, mew=0.8, ls="")
    axes.axvline(0, color=INK, lw=0.8, ls=(0, (3, 3)), alpha=0.6)
    names = [f"{row['factor']} {row['base']} → {row['level']}, {row['region']}" for row in rows]
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_yticks(list(places), names, color=INK, parse_math=False)
    axes.set_xlabel(f"change of {metric}, {shown['unit'].iloc[0]}: left of the line is lower", color=INK)
    axes.tick_params(colors=INK)
    axes.grid(True, axis="x", alpha=0.25, lw=0.6, color=INK)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.spines["bottom"].set_color(INK)
    return figure
