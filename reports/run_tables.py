"""The tables of a finished run, as they lie in its folder; no scene is needed, and nothing is scored again."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from matbench.errors import UserError, cause, one_line
from matbench.files.csv_tables import LARGEST, read_csv
from matbench.plans.plan import Plan
from matbench.reports import tables
from matbench.results import freshness
from matbench.runs.store import Store
from matbench.safe_text import hidden_in

_RESULTS = ("algorithm", "params", "scene", "view", "region", "metric", "unit")
_CELLS = ("algorithm", "params", "scene", "status", "reason")
_POINTS, _POINT_NUMBERS = ("algorithm", "params", "scene"), ("coverage", "risk", "best", "pixels")


def read_run(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """``results.csv`` and ``cells.csv`` of a finished run; its scenes are not needed.

    Raises
    ------
    UserError
        If they are missing or damaged, with the command that makes them.
    """
    if not (folder / "results.csv").exists() and _plan(folder) is not None:
        raise UserError(f"{str(folder)!r} has no tables yet: type {freshness.renewal(folder)} first")
    read = (
        _read(folder / "results.csv", _RESULTS, ("value", "pixels", "answered")),
        _read(folder / "cells.csv", _CELLS, ()),
    )
    return tables.labelled(read[0]), tables.labelled(read[1])


def read_points(folder: Path) -> pd.DataFrame:
    """``sparsification.csv`` of a finished run; empty if no method gave a confidence.

    Raises
    ------
    UserError
        If it is damaged.
    """
    path = folder / "sparsification.csv"
    if not path.exists():
        return pd.DataFrame(columns=[*_POINTS, *_POINT_NUMBERS])
    return tables.labelled(_read(path, _POINTS, _POINT_NUMBERS))


def doubt(folder: Path) -> str:
    """Why the tables of a run cannot be relied on and what to type, in one line; empty if they can, or nobody knows.

    Tables alone, without the plan of a run, are taken as they are.
    """
    plan = _plan(folder)
    why = "" if plan is None else freshness.fault(plan, Store(folder))
    return freshness.stale(folder, why) if why else ""


def _plan(folder: Path) -> Plan | None:
    """The plan of a run; None if the folder holds none that can be read."""
    try:
        return Store(folder).plan()
    except UserError:
        return None


def _again(folder: Path) -> str:
    """What to type where a table is damaged; empty if the folder is none of a run."""
    return "" if _plan(folder) is None else f"; {freshness.renewal(folder)} makes it anew"


def _read(path: Path, texts: Sequence[str], numbers: Sequence[str]) -> pd.DataFrame:
    try:
        # only in columns of numbers does nothing mean missing
        frame = read_csv(path, texts, LARGEST, numbers=True)
        for name in [name for name in numbers if name in frame or name != "answered"]:  # older tables have it not
            if name not in frame:
                raise ValueError(f"it has no column {name!r}")
            frame[name] = pd.to_numeric(frame[name].replace("", None))
    except OSError as error:
        raise UserError(f"{path} cannot be read: {cause(error)}; give the folder of a finished run") from error
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        raise UserError(f"{path} is damaged: {one_line(error)}{_again(path.parent)}") from error
    if any(hidden_in(text) for name in texts for text in frame[name].unique()):
        raise UserError(f"{path} is damaged: a text in it cannot be printed{_again(path.parent)}")
    return frame
