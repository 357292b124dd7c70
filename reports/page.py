"""The page of a run: one file that opens anywhere, without a network."""

import re
from base64 import b64encode
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from attrs import evolve
from markupsafe import Markup, escape

from matbench.files.writing import write_text
from matbench.measures.statistics import FEW
from matbench.recording import coloring
from matbench.regions import REGIONS
from matbench.reports import curves, errors, figures, passes, switches, tables
from matbench.reports.content import Report
from matbench.reports.numbers import COSTS, Numbers
from matbench.reports.pictures import gallery
from matbench.reports.tables import METRIC, REGION, Shared

__all__ = ["Report", "render", "write_page"]
if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_page(path: Path, report: Report) -> None:
    """Write the page of a run, whole or not at all."""
    write_text(path, render(report))


def render(report: Report) -> str:
    """The page of a run as HTML."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    report = evolve(report, results=tables.labelled(report.results), cells=tables.labelled(report.cells))
    rows = tables.summary(report.results, report.cells)
    # one order everywhere: best first
    scope = evolve(tables.shared(report.results, report.cells), methods=tuple(str(m) for m in rows.index))
    numbers = Numbers(report, scope)
    shown = gallery(report, scope)
    template = files("matbench.reports") / "templates"
    script = (template / "report.js").read_text(encoding="utf-8")
    environment = Environment(
        loader=PackageLoader("matbench.reports", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False, "separators": (",", ":")}
    environment.filters["breakable"] = _breakable
    by_views, by_views_notes = errors.by_views(shown.spreads, scope)
    return environment.get_template("report.html.j2").render(
        report=report,
        scope=scope,
        numbers=numbers,
        few=FEW,
        style=(template / "report.css").read_text(encoding="utf-8"),
        script=script,
        script_hash=b64encode(sha256(script.encode()).digest()).decode("ascii"),
        answer=_answer(rows, scope, numbers),
        counts=report.cells["status"].value_counts().to_dict(),
        table=_table(numbers, rows),
        costs={name: COSTS[name] for name in numbers.costs},
        timing=tables.timing_note(report.cells),
        differences=numbers.against(numbers.metric, numbers.region) if numbers.units else [],
        about=REGIONS,
        scenes=shown.scenes,
        slices=next((rows[0] for rows in shown.slices if rows), None),
        has_volumes=any(row["methods"] for rows in shown.slices for row in rows),
        energies=_svg(passes.energies(report, scope)),
        passes=passes.lines(report, scope),
        by_views=_svg(by_views),
        by_views_notes=by_views_notes,
        reliability=_svg(figures.reliability(report.reliability)),
        cost_figures=_cost_figures(numbers, rows),
        thresholds=_svg(errors.thresholds(shown.spreads, scope)),
        curves=_curves(report),
        switches=[] if report.ablation is None else switches.lines(report.ablation).values.tolist(),
        forest=None if report.ablation is None else _svg(switches.forest(report.ablation)),
        bad=_records(report.cells[report.cells["status"] != "ok"], ("method", "scene", "seed", "status", "reason")),
        methods=_methods(report),
        disparity_bar=figures.gradient(coloring.DISPARITY),
        error_bar=figures.gradient(coloring.ERROR),
        difference_bar=figures.gradient(coloring.DIFFERENCE),
        error_limit=coloring.WORST,
        data={
            **numbers.data(),
            "few": FEW,
            "worst": coloring.WORST,
            "unknown": coloring.UNKNOWN,
            "stripes": coloring.STRIPES,
            "colors": {
                "disparity": _hex(coloring.DISPARITY),
                "error": _hex(coloring.ERROR),
                "difference": _hex(coloring.DIFFERENCE),
            },
            "codings": shown.codings,
            "slices": shown.slices,
        },
    )


def _breakable(name: str) -> Markup:
    """A name, escaped, that may go on in the next line after its marks."""
    return Markup("<wbr>").join(escape(part) for part in re.split(r"(?<=[_\[=/,])", name))


def _hex(name: str) -> str:
    """A colour map's 256 colours, six hexadecimal digits each."""
    return coloring.palette(name).tobytes().hex()


def _answer(rows: pd.DataFrame, scope: Shared, numbers: Numbers) -> dict[str, Any]:
    """What the first sentence says: who is best by total_bad_1 in `all`, and how far that goes."""
    scores = rows.loc[rows["ranked"], f"{METRIC} {REGION}"].dropna()
    shown = {str(m): tables.text(v, "%") for m, v in scores.items()}
    best = [m for m in shown if shown[m] == next(iter(shown.values()))]
    rest = [m for m in shown if m not in best]
    lines = numbers.against(METRIC, REGION, best[0]) if rest else []
    verdicts = {line["method"]: line["verdict"] for line in lines}
    return {
        "best": best,
        "score": shown[best[0]] if best else "",
        "next": rest[0] if rest else None,
        "next_score": shown[rest[0]] if rest else "",
        "undecided": bool(rest) and verdicts.get(rest[0]) == "undecided",
        "compared": len(shown),
        "scenes": len(scope.scenes),
        "distinct": scope.distinct,
        "few": scope.distinct < FEW,
        "unranked": [str(m) for m in rows.index[~rows["ranked"]]],
    }


def _table(numbers: Numbers, rows: pd.DataFrame) -> list[dict[str, Any]]:
    """Method by method: mean rank, every score, costs, as they stand in the page before anything is chosen."""
    if not numbers.units:
        return []
    ranks = numbers.ranks[numbers.metric][numbers.region]
    region = numbers.region
    scores = {score: numbers.means[numbers.metric_of(score)][region] for score in numbers.scores}
    columns = [ranks, *((scores | numbers.costs)[column] for column in numbers.columns)]
    return [
        {
            "method": str(m),
            "cells": [column[str(m)] for column in columns],
            "scenes": int(row["scenes"]),
            "asked": int(row["asked"]),
            "ranked": bool(row["ranked"]),
        }
        for m, row in rows.iterrows()
    ]


def _cost_figures(numbers: Numbers, rows: pd.DataFrame) -> list[str]:
    """Accuracy against seconds, and against memory."""
    memory = {m: entry[0] for m, entry in numbers.costs.get("peak_mb", {}).items()}
    costs = rows.assign(memory=pd.Series(memory, dtype=float).reindex(rows.index))
    drawn = (figures.cost(costs, f"{METRIC} {REGION}", "%", against) for against in figures.COSTS)
    return [figures.svg(figure) for figure in drawn if figure is not None]


def _svg(figure: "Figure | None") -> str | None:
    return None if figure is None else figures.svg(figure)


def _curves(report: Report) -> list[dict[str, Any]]:
    """Sweep by sweep: title, caption, figure and the numbers in it."""
    return [
        {
            "title": curves.title(sweep),
            "caption": curves.caption(sweep),
            "figure": _svg(curves.figure(sweep)),
            "heads": [f"{value:g}" for value in sweep.values],
            "lines": curves.lines(sweep).values.tolist(),
        }
        for sweep in report.sweeps
    ]


def _methods(report: Report) -> list[dict[str, Any]]:
    """What was run: per method its parameters, cells and cost."""
    out = []
    for method, rows in report.cells.groupby("method", sort=False):
        ok = rows[rows["status"] == "ok"]
        peak = ok["peak_mb"].astype(float).max() if "peak_mb" in ok else np.nan
        names = str(rows["algorithm"].iloc[0]), str(rows["params"].iloc[0])
        out.append(
            {
                "method": str(method),
                "algorithm": names[0],
                "params": names[1],
                "all": [(name, str(value)) for name, value in report.parameters.get(names, {}).items()],
                "ok": f"{len(ok)} of {len(rows)}",
                "seconds": tables.text(ok["seconds"].astype(float).sum(min_count=1), "s"),
                "peak": "–" if pd.isna(peak) else f"{peak:.0f}",
            }
        )
    return out


def _records(frame: pd.DataFrame, columns: tuple[str, ...]) -> list[list[str]]:
    def shown(value: object) -> str:
        return "" if value is None or value is pd.NA or value != value else str(value)

    return [[shown(row.get(c)) for c in columns] for row in frame.to_dict("records")]
