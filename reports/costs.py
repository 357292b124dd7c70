"""What a run cost: seconds and memory, and which seconds may be compared."""

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

if TYPE_CHECKING:
    from matbench.reports.tables import Shared

CLOCK = "wall"
"""Whose seconds are shown and ranked: by the clock on the wall."""


def timed_alike(cells: pd.DataFrame) -> pd.Series:
    """Which cells' seconds may be compared, as a mask.

    Those that nothing disturbed, on one machine with one number of threads: where there are several, that which has
    the most cells.
    """
    good = (cells["status"] == "ok") & ~disturbed(cells)
    where = _places(cells)
    places = where[good].value_counts(sort=False)
    return good & (where == places.idxmax()) if len(places) else good


def _places(cells: pd.DataFrame) -> pd.Series:
    """On which machine, with how many threads."""
    where = pd.Series("", cells.index)
    for name in ("machine", "threads"):
        where += " " + cells.get(name, pd.Series("", cells.index)).astype(str)
    return where


def disturbed(cells: pd.DataFrame) -> pd.Series:
    """A mask of the cells whose seconds are in doubt: other cells ran meanwhile, or others took the processors."""
    company = cells.get("alone", pd.Series(True, cells.index)).astype(str) == "False"
    doubt = cells.get("doubt", pd.Series("", cells.index)).astype(object).fillna("").astype(str) != ""
    return company | doubt


def timing_note(cells: pd.DataFrame) -> str:
    """What is to be said of times that are not compared; empty if all are."""
    ok = int((cells["status"] == "ok").sum())
    alike = int(timed_alike(cells).sum())
    if alike == ok:
        return ""
    return (
        f"{CLOCK} time: {alike} of {ok} cells can be compared; the others ran on another machine, beside other cells, "
        "while other programs took the processors, or not at all "
        "(ready-made answers). Methods with such cells (*) are not ranked by it"
    )


def seconds(cells: pd.DataFrame, scope: "Shared") -> pd.DataFrame:
    """What each method took, per scene, over the same scenes as its scores.

    Parameters
    ----------
    cells
        As `matbench.reports.tables.labelled` makes them.

    Returns
    -------
    Index: the methods. Columns: ``seconds``, the mean over scenes (of a cell that was repeated, its median);
    ``least`` and ``most``, the means of the shortest and of the longest repeats, NaN where no cell was repeated;
    ``alike``, may it be ranked? NaN where a scene has no time, or not all were solved on one machine with one number
    of threads.
    """
    cells = cells.reset_index(drop=True)
    alike = timed_alike(cells)
    rows = cells[cells["status"] == "ok"]
    taken = pd.DataFrame({"method": rows["method"], "scene": rows["scene"], "seconds": rows["seconds"].astype(float)})
    for name in ("least", "most"):
        given = rows.get(f"seconds_{name}", pd.Series(np.nan, rows.index))
        taken[name] = pd.to_numeric(given, errors="coerce").astype(float)
    repeated = taken["least"].notna().groupby(taken["method"]).transform("any")
    for name in ("least", "most"):  # a cell that was solved once took what it took
        taken[name] = taken[name].fillna(taken["seconds"]).where(repeated)
    taken["alike"], taken["place"] = alike[rows.index], _places(rows)
    out = {}
    for method in scope.methods:
        here = taken[(taken["method"] == method) & taken["scene"].isin(scope.counted(method))]
        by_scene = here.groupby("scene")[["seconds", "least", "most"]].mean()
        means = by_scene.reindex(list(scope.counted(method))).mean(skipna=False)
        if here["place"].nunique() != 1:
            means[:] = np.nan
        out[method] = {**means, "alike": bool(len(here) and here["alike"].all())}
    return pd.DataFrame.from_dict(out, orient="index", columns=["seconds", "least", "most", "alike"])


def memory(cells: pd.DataFrame, scope: "Shared", column: str = "peak_mb") -> pd.Series:
    """Method -> peak memory of the scene that took most, of those that count: what a machine must have.

    Other columns of the cells are taken in the same way.
    """
    good = cells[cells["status"] == "ok"]
    table = good.assign(peak=good[column].astype(float)).groupby(["scene", "method"])["peak"].max().unstack("method")
    wide = table.reindex(index=list(scope.asked), columns=list(scope.methods))
    return pd.Series({m: wide.loc[list(scope.counted(m)), m].max(skipna=False) for m in scope.methods}, dtype=float)
