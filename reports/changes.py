"""What has changed since an earlier run, as tables for the terminal."""

from collections.abc import Sequence

import pandas as pd
from rich.table import Table
from rich.text import Text

from matbench.measures.metrics import Better
from matbench.reports.standing import words
from matbench.reports.tables import REGION, REGIONS, interval, label, text
from matbench.reports.terminal import plain

MOST = 40
"""Cells that are shown one by one, those that changed most first; ``changes.csv`` has all."""


def terminal(changes: pd.DataFrame, effects: pd.DataFrame, metric: str, better: Better, since: str) -> list[Table]:
    """Every cell in `REGION`, and the mean changes of the field's regions with their intervals.

    Parameters
    ----------
    changes, effects
        As `matbench.results.changes` makes them.
    metric
        What is shown.
    since
        What the earlier run is called.
    """
    cells = changes[(changes["metric"] == metric) & (changes["region"] == REGION)]
    if cells.empty:
        return []
    unit = str(cells["unit"].iloc[0]) if pd.notna(cells["unit"].iloc[0]) else ""
    head = f"{metric} ({unit})" if unit else metric
    shown = cells.reindex(cells["change"].abs().sort_values(ascending=False, kind="stable").index[:MOST])
    more = f"; {MOST} of {len(cells)} cells, those that changed most" if len(cells) > MOST else ""
    by_cell = plain(f"{head} in {REGION!r}, since {since}{more}")
    _columns(by_cell, ("method", "scene"), ("before", "now", "change"))
    for row in shown.to_dict("records"):
        seed = f", seed {row['seed']}" if row["seed"] else ""
        by_cell.add_row(
            Text(label(row["algorithm"], row["params"])),
            Text(f"{row['scene']}{seed}"),
            *(Text(text(row[name], unit)) for name in ("before", "now")),
            Text(text(row["change"], unit, signed=True)),
        )
    means = effects[(effects["metric"] == metric) & effects["region"].isin(REGIONS)]
    by_region = plain(f"{head}: mean change since {since}, 95 % interval over scenes")
    _columns(by_region, ("method", "region"), ("change", "interval", "scenes", "verdict"))
    for row in means.to_dict("records"):
        by_region.add_row(
            Text(label(row["algorithm"], row["params"])),
            str(row["region"]),
            text(row["change"], unit, signed=True),
            interval(row["low"], row["high"]),
            str(row["scenes"]),
            words(str(row["verdict"]), higher=better == "higher"),
        )
    return [by_cell, by_region]


def _columns(table: Table, names: Sequence[str], numbers: Sequence[str]) -> None:
    for name in names:
        table.add_column(name, overflow="fold", min_width=8)
    for name in numbers:
        table.add_column(name, justify="left" if name == "verdict" else "right", no_wrap=name != "verdict")
