"""The page of a run: one file that opens anywhere, without a network."""

import re
from base64 import b64encode
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from attrs import evolve
from markupsafe import Markup, escape

from matbench import coloring
from matbench.reports import curves, figures, switches, tables
from matbench.reports.content import Report
from matbench.reports.tables import METRIC, REGION, Shared
from matbench.scene import Scene
from matbench.statistics import FEW
from matbench.store import write_text

__all__ = ["Report", "render", "write"]
if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAPTIONED = ("nonocc", "all", "occ")


def write(path: Path, report: Report) -> None:
    """Write the page of a run, whole or not at all."""
    write_text(path, render(report))


def render(report: Report) -> str:
    """The page of a run as HTML."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    report = evolve(report, results=tables.labelled(report.results), cells=tables.labelled(report.cells))
    rows = tables.summary(report.results, report.cells)
    # one order everywhere: best first
    scope = evolve(tables.shared(report.results, report.cells), methods=tuple(str(m) for m in rows.index))
    template = files("matbench.reports") / "templates"
    script = (template / "report.js").read_text(encoding="utf-8")
    environment = Environment(
        loader=PackageLoader("matbench.reports", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False}  # columns are in the order of the regions
    environment.filters["breakable"] = _breakable
    return environment.get_template("report.html.j2").render(
        report=report,
        scope=scope,
        few=FEW,
        style=(template / "report.css").read_text(encoding="utf-8"),
        script=script,
        script_hash=b64encode(sha256(script.encode()).digest()).decode("ascii"),
        answer=_answer(rows, scope),
        counts=report.cells["status"].value_counts().to_dict(),
        table=_default_table(rows),
        regions=tables.summarised(report.results),
        scenes_table=_default_scenes(report, scope),
        data=_data(report, scope),
        figure=_figure(rows),
        curves=_curves(report),
        scenes=_scenes(report, scope),
        disparity_bar=figures.gradient(coloring.DISPARITY),
        error_bar=figures.gradient(coloring.ERROR),
        error_limit=coloring.WORST,
        bad=_records(report.cells[report.cells["status"] != "ok"], ("method", "scene", "seed", "status", "reason")),
        methods=_methods(report.cells),
        switches=[] if report.ablation is None else switches.lines(report.ablation).values.tolist(),
        reliability=_svg(figures.reliability(report.reliability)),
        forest=None if report.ablation is None else _svg(switches.forest(report.ablation)),
    )


def _breakable(name: str) -> Markup:
    """A name, escaped, that may go on in the next line after its marks."""
    return Markup("<wbr>").join(escape(part) for part in re.split(r"(?<=[_\[=/,])", name))


def _answer(rows: pd.DataFrame, scope: Shared) -> dict[str, Any]:
    """What the first sentence says: who is best by total_bad_1 in `all`, and how far that goes."""
    scores = rows.loc[rows["ranked"], f"{METRIC} {REGION}"].dropna()
    shown = {str(m): tables.text(v, "%") for m, v in scores.items()}
    best = [m for m in shown if shown[m] == next(iter(shown.values()))]
    rest = [m for m in shown if m not in best]
    return {
        "best": best,
        "score": shown[best[0]] if best else "",
        "next": rest[0] if rest else None,
        "next_score": shown[rest[0]] if rest else "",
        "compared": len(shown),
        "scenes": len(scope.scenes),
        "distinct": scope.distinct,
        "few": scope.distinct < FEW,
        "unranked": [str(m) for m in rows.index[~rows["ranked"]]],
    }


def _entries(values: pd.Series, ranked: pd.Series, unit: str, higher: bool) -> dict[str, list[Any]]:
    """Method -> [number or None, as shown, place]: what a cell of a table needs, here and in the script."""
    marks = tables.places(values[ranked], unit, higher)
    return {
        str(m): [None if pd.isna(v) else float(v), tables.text(v, unit), int(marks.get(m, 0))]
        for m, v in values.items()
    }


def _default_table(rows: pd.DataFrame) -> list[dict[str, Any]]:
    """The summary's rows, as they stand in the page before anything is chosen."""
    units = {c: "s" if c == "seconds" else "px" if c == "avg all" else "%" for c in rows.columns[:-3]}
    entries = {c: _entries(rows[c], rows["ranked"], unit, higher=False) for c, unit in units.items()}
    return [
        {
            "method": str(m),
            "cells": [entries[c][str(m)] for c in units],
            "scenes": int(row["scenes"]),
            "asked": int(row["asked"]),
            "ranked": bool(row["ranked"]),
        }
        for m, row in rows.iterrows()
    ]


def _scene_entries(report: Report, scope: Shared, table: pd.DataFrame, metric: str) -> list[list[list[Any]]]:
    """Scenes x methods of entries; the status stands where a cell did not end well."""
    unit, higher = tables.metrics(report.results).get(metric, ""), metric in report.higher
    bad = report.cells[report.cells["status"] != "ok"]
    status = {(m, s): state for m, s, state in zip(bad["method"], bad["scene"], bad["status"], strict=True)}
    out = []
    for scene, row in table.reindex(index=scope.asked, columns=scope.methods).iterrows():
        has = pd.Series({m: scene in scope.has[m] for m in scope.methods}, dtype=bool)
        entries = _entries(row.where(has), has, unit, higher)
        for m in scope.methods:
            if (m, scene) in status:
                entries[m] = [None, str(status[m, scene]), 0]
        out.append([entries[m] for m in scope.methods])
    return out


def _default_scenes(report: Report, scope: Shared) -> list[tuple[str, list[list[Any]]]]:
    table = tables.per_scene(report.results, REGION, METRIC)
    return list(zip(scope.asked, _scene_entries(report, scope, table, METRIC), strict=True))


def _data(report: Report, scope: Shared) -> dict[str, Any]:
    """Everything that the page lets one choose: summary and scenes for each metric and region."""
    units, found = tables.metrics(report.results), tables.regions(report.results)
    shown = tables.summarised(report.results)
    ranked = pd.Series({m: scope.is_ranked(m) for m in scope.methods}, dtype=bool)
    parts = {(str(m), str(r)): part for (m, r), part in report.results.groupby(["metric", "region"], sort=False)}
    means: dict[str, dict[str, Any]] = {m: {} for m in units}
    scenes: dict[str, dict[str, Any]] = {m: {} for m in units}
    for metric, unit in units.items():
        for region in dict.fromkeys((*shown, *found)):
            part = parts.get((metric, region), report.results.iloc[:0])
            table = tables.per_scene(part, region, metric)
            if region in found:
                scenes[metric][region] = _scene_entries(report, scope, table, metric)
            if region in shown:
                mean = tables.over_scenes(table, scope)
                means[metric][region] = _entries(mean, ranked, unit, metric in report.higher)
    return {"methods": list(scope.methods), "regions": found, "units": units, "means": means, "scenes": scenes}


def _figure(rows: pd.DataFrame) -> str | None:
    return _svg(figures.cost(rows, f"{METRIC} {REGION}", "%"))


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


def _scenes(report: Report, scope: Shared) -> Iterator[dict[str, Any]]:
    """Scene by scene, the pictures: made when the template comes to them."""
    for name in scope.asked:
        cells = sorted(_first_seeds(report.cells, name), key=lambda c: scope.methods.index(c["method"]))
        scene = report.scenes.get(name)
        if scene is None:
            yield {"name": name, "known": False}
            continue
        truth = scene.truth.get(scene.ref)
        low, high = coloring.disparity_ends(scene)
        yield {
            "name": name,
            "known": True,
            "views": scene.n,
            "ref": scene.labels[scene.ref],
            "size": (scene.width, scene.height),
            "pair_steps": f"{scene.pair_steps:g}",
            "scale": [f"{v:.3g}" for v in (low, (low + high) / 2, high)],
            "view": figures.data_uri(scene.views[scene.ref], exact=False),
            "truth": None
            if truth is None
            else figures.data_uri(coloring.truth_colors(truth, (low, high), figures.LEVELS)),
            "methods": _all_pictures(report, scene, cells, (low, high)),
        }


def _first_seeds(cells: pd.DataFrame, scene: str) -> list[dict[str, Any]]:
    """One cell for each method on a scene: its first that is ok, else its first."""
    here = cells[cells["scene"] == scene].assign(bad=lambda c: c["status"] != "ok")
    first = here.sort_values("bad", kind="stable").drop_duplicates("method").sort_index()
    seeds = here.groupby("method").size()
    return [{**row, "seeds": int(seeds[row["method"]])} for row in _dicts(first)]


def _all_pictures(
    report: Report, scene: Scene, cells: list[dict[str, Any]], ends: tuple[float, float]
) -> list[dict[str, Any]]:
    with ThreadPoolExecutor() as pool:  # the encoder lets go of the interpreter
        return list(pool.map(lambda cell: _pictures(report, scene, cell, ends), cells))


def _pictures(report: Report, scene: Scene, cell: dict[str, Any], ends: tuple[float, float]) -> dict[str, Any]:
    names = str(cell["algorithm"]), str(cell["params"]), str(cell["scene"]), int(cell["seed"])
    disparity = report.disparity(*names) if cell["status"] == "ok" else None
    out = {
        "method": cell["method"],
        "status": cell["status"],
        "reason": _shown(cell.get("reason")),
        "seed": cell["seed"] if cell["seeds"] > 1 else None,
        "scores": [],
        "disparity": None,
        "error": None,
    }
    if disparity is None:
        return out
    disparity = disparity.astype(np.float32, copy=False)
    out["disparity"] = figures.data_uri(coloring.disparity_colors(disparity, ends, figures.LEVELS))
    truth = scene.truth.get(scene.ref)
    if truth is not None:
        out["error"] = figures.data_uri(coloring.error_colors(disparity, truth, scene.pair_steps, figures.LEVELS))
    rows = report.results
    rows = rows[
        (rows["method"] == cell["method"])
        & (rows["scene"] == cell["scene"])
        & (rows["seed"] == cell["seed"])
        & (rows["metric"] == METRIC)
    ]
    value = dict(zip(rows["region"], rows["value"], strict=True))
    out["scores"] = [(region, tables.text(value.get(region, np.nan), "%")) for region in CAPTIONED]
    return out


def _methods(cells: pd.DataFrame) -> list[dict[str, str]]:
    """What was run: per method its parameters, cells and cost."""
    out = []
    for method, rows in cells.groupby("method", sort=False):
        ok = rows[rows["status"] == "ok"]
        peak = ok["peak_mb"].astype(float).max() if "peak_mb" in ok else np.nan
        out.append(
            {
                "method": str(method),
                "algorithm": str(rows["algorithm"].iloc[0]),
                "params": str(rows["params"].iloc[0]),
                "ok": f"{len(ok)} of {len(rows)}",
                "seconds": tables.text(ok["seconds"].astype(float).sum(min_count=1), "s"),
                "peak": "–" if pd.isna(peak) else f"{peak:.0f}",
            }
        )
    return out


def _shown(value: object) -> str:
    return "" if value is None or value is pd.NA or value != value else str(value)


def _dicts(frame: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(k): v for k, v in row.items()} for row in frame.to_dict("records")]


def _records(frame: pd.DataFrame, columns: tuple[str, ...]) -> list[list[str]]:
    return [[_shown(row.get(c)) for c in columns] for row in _dicts(frame)]
