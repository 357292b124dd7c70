"""The report page of a run: one HTML file that opens anywhere, without a network."""

import json
import re
from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from attrs import evolve
from markupsafe import Markup, escape

from matbench.files.writing import write_text
from matbench.measures.metrics import ENOUGH
from matbench.measures.statistics import FEW
from matbench.recording import coloring
from matbench.regions import LEAST_PIXELS, LEAST_SHARE, REGIONS
from matbench.reports import (
    confidence_figure,
    costs,
    curves,
    error_spread,
    page_figures,
    passes,
    rank_figure,
    standing,
    switches,
    tables,
)
from matbench.reports.content import Report
from matbench.reports.numbers import COSTS, Numbers
from matbench.reports.pictures import MOST, gallery
from matbench.reports.tables import METRIC, REGION, Shared
from matbench.safe_text import printable
from matbench.typed import Value

__all__ = ["Report", "render", "write_page"]
if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_PAGE = 14_500_000
"""The most characters of a page, about: what is not pictures is measured first."""


def write_page(path: Path, report: Report) -> None:
    """Write the page of a run. The file is complete or not there."""
    write_text(path, render(report))


def render(report: Report) -> str:
    """The page of a run as HTML."""
    with page_figures.page_look():
        return _render(report)


def _render(report: Report) -> str:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    report = evolve(report, results=tables.labelled(report.results), cells=tables.labelled(report.cells))
    first = _first_metric(report)
    rows = tables.summary(report.results, report.cells, first, report.better.get(first, "lower"))
    # methods stand in the same order everywhere on the page: best first
    scope = evolve(tables.shared(report.results, report.cells), methods=tuple(str(m) for m in rows.index))
    numbers = Numbers(evolve(report, metric=first), scope)
    pictured = evolve(scope, asked=numbers.shown)
    chosen = numbers.data()
    shown = gallery(report, pictured, most=min(MOST, MOST_PAGE - len(json.dumps(chosen))))
    template = files("matbench.reports") / "templates"
    script = (template / "report.js").read_text(encoding="utf-8")
    environment = Environment(
        loader=PackageLoader("matbench.reports", "templates"),
        autoescape=True,
        finalize=_inert,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False, "separators": (",", ":")}
    environment.filters["breakable"] = _breakable
    by_views, by_views_notes = error_spread.by_views(shown.spreads, scope)
    return environment.get_template("report.html.j2").render(
        report=report,
        scope=scope,
        numbers=numbers,
        few=FEW,
        correction=standing.correction(sum(scope.is_ranked(m) for m in scope.methods)),
        ranks=_ranks(numbers),
        style=(template / "report.css").read_text(encoding="utf-8"),
        script=script,
        script_hash=b64encode(sha256(script.encode()).digest()).decode("ascii"),
        answer=_answer(rows, scope, numbers, first),
        first=first,
        first_unit=numbers.units.get(first, "%"),
        unit=f"\N{NO-BREAK SPACE}{unit}" if (unit := numbers.units.get(first, "%")) else "",
        counts=report.cells["status"].value_counts().to_dict(),
        table=_table(numbers, rows),
        table_counts=[numbers.counts[numbers.metric][numbers.region], *map(numbers.count, numbers.columns)]
        if numbers.units
        else [],
        costs={name: COSTS[name] for name in numbers.costs},
        timing=costs.timing_note(report.cells).replace(" (*)", ""),  # the page says it in words
        clock=costs.CLOCK,
        silences=tables.silences(report.results, scope),
        enough=ENOUGH,
        least=(LEAST_PIXELS, LEAST_SHARE),
        differences=numbers.against(numbers.metric, numbers.region) if numbers.units else [],
        about=REGIONS,
        scenes=shown.scenes,
        slices=next((rows[0] for rows in shown.slices if rows), None),
        has_volumes=any(row["methods"] for rows in shown.slices for row in rows),
        energies=_svg(passes.energies(report, scope)),
        passes=passes.lines(report, scope),
        by_views=_svg(by_views),
        by_views_notes=by_views_notes,
        reliability=_svg(page_figures.reliability(report.reliability)),
        **_confidence(report, scope),
        cost_figures=_cost_figures(numbers, rows, first),
        thresholds=_svg(error_spread.thresholds(shown.spreads, scope)),
        curves=_curves(report, first),
        switches=[] if report.ablation is None else switches.lines(report.ablation, first).values.tolist(),
        forest=None if report.ablation is None else _svg(switches.forest(report.ablation, first)),
        bad=_records(report.cells[report.cells["status"] != "ok"], ("method", "scene", "seed", "status", "reason")),
        methods=_methods(report),
        disparity_bar=page_figures.gradient(coloring.DISPARITY),
        error_bar=page_figures.gradient(coloring.ERROR),
        difference_bar=page_figures.gradient(coloring.DIFFERENCE),
        error_limit=coloring.WORST,
        data={
            **chosen,
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


def _confidence(report: Report, scope: Shared) -> dict[str, Any]:
    """The figure of risk over coverage, the table beside it, and its head."""
    points = report.sparsification
    found, about = {}, ""
    if points is not None and not points.empty:
        points = confidence_figure.comparable(points, scope)
        found = confidence_figure.curves(points, scope.methods)
        about = confidence_figure.caption(*confidence_figure.scenes_of(points, found)) if found else ""
    return {
        "risks": _svg(confidence_figure.figure(found, page_figures.INK)),
        "sureness": confidence_figure.lines(report.results, scope) if found else [],
        "sureness_head": confidence_figure.COLUMNS,
        "risks_about": about,
    }


def _inert(value: Any) -> Any:
    """What a template shows, printable: a mark of writing direction would make a text look like another one."""
    return printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _breakable(name: str) -> Markup:
    """A name, escaped, in which a browser may break the line after punctuation."""
    return Markup("<wbr>").join(escape(part) for part in re.split(r"(?<=[_\[=/,])", printable(name)))


def _hex(name: str) -> str:
    """A colour map's 256 colours, six hexadecimal digits each."""
    return coloring.palette(name).tobytes().hex()


def _first_metric(report: Report) -> str:
    """What methods are ranked by: what the report says, if it was measured."""
    return report.metric if (report.results["metric"] == report.metric).any() else METRIC


def _answer(rows: pd.DataFrame, scope: Shared, numbers: Numbers, metric: str) -> dict[str, Any]:
    """The facts of the first sentence: which method is best by a metric in `all`, and how sure that is."""
    scores = rows.loc[rows["ranked"], f"{metric} {REGION}"].dropna()
    unit = numbers.units.get(metric, "%")
    shown = {str(m): tables.text(v, unit) for m, v in scores.items()}
    best = [m for m in shown if shown[m] == next(iter(shown.values()))]
    rest = [m for m in shown if m not in best]
    lines = numbers.against(metric, REGION, best[0]) if rest else []
    verdicts = {line["method"]: line["verdict"] for line in lines}
    return {
        "best": best,
        "score": shown[best[0]] if best else "",
        "next": rest[0] if rest else None,
        "next_score": shown[rest[0]] if rest else "",
        "undecided": bool(rest) and verdicts.get(rest[0], "").startswith("undecided"),
        "enough": _enough(verdicts.get(rest[0], "")) if rest else "",
        "compared": len(shown),
        "scenes": len(scope.scenes),
        "distinct": scope.distinct,
        "few": scope.distinct < FEW,
        "unranked": [str(m) for m in rows.index[~rows["ranked"]]],
    }


def _enough(verdict: str) -> str:
    """How many scenes would decide, in brackets, where a verdict says so."""
    said = verdict.partition(": ")[2]
    return f" ({said})" if said else ""


def _ranks(numbers: Numbers) -> tuple[str, str] | None:
    """The critical-difference diagram of the metric and region that are shown first, and its caption."""
    if not numbers.units:
        return None
    found = numbers.ranking(numbers.metric, numbers.region)
    if found is None:
        return None
    figure = rank_figure.figure(found, page_figures.INK)
    return page_figures.svg(figure), rank_figure.caption(found, numbers.metric, numbers.region)


def _table(numbers: Numbers, rows: pd.DataFrame) -> list[dict[str, Any]]:
    """The first table before anything is chosen: for each method its mean rank, scores and costs."""
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


def _cost_figures(numbers: Numbers, rows: pd.DataFrame, metric: str) -> list[str]:
    """Accuracy against seconds, and against memory."""
    memory = {m: entry[0] for m, entry in numbers.costs.get("peak_mb", {}).items()}
    known = rows.assign(memory=pd.Series(memory, dtype=float).reindex(rows.index))
    known["seconds"] = known["seconds"].where(known["alike"])
    drawn = (
        page_figures.cost(known, f"{metric} {REGION}", numbers.units.get(metric, "%"), against)
        for against in page_figures.COSTS
    )
    return [page_figures.svg(figure) for figure in drawn if figure is not None]


def _svg(figure: "Figure | None") -> str | None:
    return None if figure is None else page_figures.svg(figure)


def _curves(report: Report, metric: str) -> list[dict[str, Any]]:
    """For each sweep its title, caption, figure and table."""
    return [
        {
            "title": curves.title(sweep),
            "caption": curves.caption(sweep, metric),
            "figure": _svg(curves.figure(sweep, metric)),
            "heads": [f"{value:g}" for value in sweep.values],
            "lines": curves.lines(sweep, metric).values.tolist(),
        }
        for sweep in report.sweeps
    ]


def _methods(report: Report) -> list[dict[str, Any]]:
    """What was run: for each method its parameters, cells and cost."""
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
                "all": _by_group(report.parameters.get(names, {}), report.groups.get(names[0], {})),
                "ok": f"{len(ok)} of {len(rows)}",
                "seconds": tables.text(ok["seconds"].astype(float).sum(min_count=1), "s"),
                "peak": "–" if pd.isna(peak) else f"{peak:.0f}",
            }
        )
    return out


def _by_group(parameters: Mapping[str, Value], groups: Mapping[str, str]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Group in words -> its parameters with their values; those of no group first."""
    found: dict[str, list[tuple[str, str]]] = {}
    for name, value in sorted(parameters.items(), key=lambda item: item[0] in groups):
        found.setdefault(groups.get(name, "").replace("_", " "), []).append((name, str(value)))
    return list(found.items())


def _records(frame: pd.DataFrame, columns: tuple[str, ...]) -> list[list[str]]:
    def shown(value: object) -> str:
        return "" if value is None or value is pd.NA or value != value else str(value)

    return [[shown(row.get(c)) for c in columns] for row in frame.to_dict("records")]
