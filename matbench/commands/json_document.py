"""The document of `--json`: what a script is told of a run."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matbench.prepared import Comparison
from matbench.reports import costs, standing, tables
from matbench.results.metric_catalogue import better


def document(
    ready: Comparison, results: Any, cells: Any, metrics: Sequence[str], written: dict[str, Path], stopped: bool
) -> dict[str, Any]:
    """The document of `--json`: the run folder, the status of its cells, and the rows of the summary.

    Keys: ``folder``; ``files``, what was written; ``interrupted``; ``cells``, status -> how many; ``unscored``,
    each cell without a score with its reason; ``left_out``, why -> scenes; ``metric``; ``table``, the methods, best
    first, with their means over the scenes they share in ``regions``, ``avg`` (pixels of the pair, in `all`) and
    ``seconds``; null where there is no number. ``counted``: region -> how many scenes its means are over. Of each
    method also ``answered``: region -> per cent of the pixels that its mean is over; ``answers``: per cent of the
    pixels of `all` that it answers; ``seconds_ranked``: may its seconds be compared? and ``remark``: why it is not
    ranked, and what it leaves unanswered. ``clock``: whose seconds these are. ``lead``: the differences
    from the best method in `all`, as `matbench.reports.standing.lead` finds them. ``metrics``: every metric that was
    asked for, with its ``name``, ``unit``, ``better`` and ``means``, method -> region -> number.
    """
    metric = metrics[0]
    regions, scope = tables.summarised(results), tables.shared(results, cells)
    counted = {region: tables.count(tables.per_scene(results, region, metric), scope) for region in regions}
    answered = {region: tables.means(results, scope, region, metric, "answered") for region in regions}
    rows = [
        {
            "method": str(method),
            "ranked": bool(row["ranked"]),
            "scenes": int(row["scenes"]),
            "asked": int(row["asked"]),
            "regions": {region: _number(row[f"{metric} {region}"]) for region in regions},
            "avg": _number(row["avg all"]),
            "seconds": _number(row["seconds"]),
            "seconds_ranked": bool(row["alike"]),
            "answered": {region: _number(answered[region][str(method)]) for region in regions},
            "answers": _number(row["answers"]),
            "remark": str(row["remark"]),
        }
        for method, row in tables.summary(results, cells, metric, better(metric)).iterrows()
    ]
    bad = tables.labelled(cells)
    bad = bad[bad["status"] != "ok"]
    columns = ["method", "scene", "seed", "status", "reason"]
    return {
        "folder": str(ready.folder),
        "files": {what: str(path) for what, path in written.items()},
        "interrupted": stopped,
        "cells": {str(status): int(count) for status, count in cells["status"].value_counts().items()},
        "unscored": [dict(zip(columns, map(_plain, row), strict=True)) for row in bad[columns].to_numpy().tolist()],
        "left_out": {reason: list(scenes) for reason, scenes in ready.left_out.items()},
        "metric": {"name": metric, "unit": tables.metrics(results).get(metric, ""), "better": better(metric)},
        "counted": counted,
        "clock": costs.CLOCK,
        "lead": _lead(results, cells, metric),
        "table": rows,
        "metrics": [_means(results, scope, name) for name in metrics],
    }


def _lead(results: Any, cells: Any, metric: str) -> dict[str, Any]:
    """The best method, and the differences of the others from it, in the metric's unit."""
    found = standing.lead(results, cells, metric, better(metric))
    behind = [
        {
            "method": method,
            "difference": _number(effect.mean),
            "interval": [_number(effect.low), _number(effect.high)],
            "p": _number(effect.p),
            "verdict": standing.words(effect.verdict, better(metric) == "higher"),
            "enough": effect.enough,
            "scenes": effect.scenes,
        }
        for method, effect in found.behind.items()
    ]
    return {"best": found.best or None, "behind": behind}


def since(run: Path | None, effects: Any) -> dict[str, Any]:
    """What has changed since an earlier run, for the document: ``folder``, and the rows of ``effects``."""
    rows = [{key: _null(value) for key, value in row.items()} for row in effects.to_dict("records")]
    return {"folder": str(run), "effects": rows}


def _means(results: Any, scope: tables.Shared, metric: str) -> dict[str, Any]:
    """The means of a metric over the scenes that the methods share, for the document."""
    regions = tables.regions(results[results["metric"] == metric])
    columns = {region: tables.means(results, scope, region, metric) for region in regions}
    means = {m: {region: _number(column[m]) for region, column in columns.items()} for m in scope.methods}
    unit = tables.metrics(results).get(metric, "")
    return {"name": metric, "unit": unit, "better": better(metric), "means": means}


def _null(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _number(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None


def _plain(value: Any) -> Any:
    return "" if isinstance(value, float) and math.isnan(value) else value
