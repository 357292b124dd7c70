"""Tables of a run, computed from its stored maps: no method runs again for a new metric."""

from collections.abc import Mapping
from functools import cache

import numpy as np
import pandas as pd

from matbench import plugins
from matbench.errors import UserError
from matbench.metrics import Metric, score
from matbench.plan import Plan
from matbench.scene import Scene
from matbench.store import Store

RESULT_COLUMNS = ("algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels")
CELL_COLUMNS = (
    "algorithm",
    "params",
    "scene",
    "seed",
    "status",
    "seconds",
    "warmup_seconds",
    "peak_mb",
    "threads",
    "work",
    "reason",
    "cell",
)


def metrics() -> tuple[Metric, ...]:
    """Every metric that plug-ins offer, the built-in ones first; broken plug-ins are left out."""
    return _metrics()[0]


def broken_metrics() -> Mapping[str, str]:
    """The metric plug-ins that cannot be imported or give no new metrics, with what is wrong."""
    return _metrics()[1]


@cache
def _metrics() -> tuple[tuple[Metric, ...], Mapping[str, str]]:
    found: dict[str, Metric] = {}
    broken: dict[str, str] = {}
    by_source = sorted(plugins.installed("metrics").values(), key=lambda p: p.source != "matbench-stereo")
    for plugin in by_source:
        try:
            loaded = plugin.load()
            offered = [loaded] if isinstance(loaded, Metric) else list(loaded)
        except (UserError, TypeError) as error:
            broken[plugin.name] = str(error)
            continue
        if all(isinstance(metric, Metric) and metric.name not in found for metric in offered):
            found |= {metric.name: metric for metric in offered}
        else:
            broken[plugin.name] = f"plug-in {plugin.name!r} from {plugin.source} offers no Metric of a new name"
    return tuple(found.values()), broken


def results(plan: Plan, store: Store, scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """One row for each finished cell, region of the reference view and metric.

    Columns are `RESULT_COLUMNS`: shares in per cent of `pixels`, errors in pixels of the pair.
    """
    used, rows = metrics(), []
    for cell in plan.cells:
        outcome = store.outcome(cell)
        if outcome is None or outcome.status != "ok":
            continue
        scene = scenes[cell.scene]
        estimate, truth = store.disparity(cell)[scene.ref], scene.truth[scene.ref]
        for region, mask in scene.scored_regions.items():
            values = score(estimate, truth, mask, scene.pair_steps, used)
            head = (cell.method.algorithm, cell.method.changed, cell.scene, scene.labels[scene.ref], cell.seed, region)
            pixels = int((mask & np.isfinite(truth)).sum())
            rows += [(*head, m.name, values[m.name], m.unit, pixels) for m in used]
    return pd.DataFrame(rows, columns=list(RESULT_COLUMNS))


def cells(plan: Plan, store: Store) -> pd.DataFrame:
    """One row for each cell of the plan: what became of it and what it cost (`CELL_COLUMNS`)."""
    rows: list[tuple[object, ...]] = []
    for cell in plan.cells:
        outcome = store.outcome(cell)
        head = (cell.method.algorithm, cell.method.changed, cell.scene, cell.seed)
        if outcome is None:
            rows.append((*head, "interrupted", None, None, None, None, "", "not computed yet", cell.key))
            continue
        cost = (outcome.seconds, outcome.warmup_seconds, outcome.peak_mb, outcome.threads)
        work = " ".join(f"{name}={count}" for name, count in outcome.work.items())
        rows.append((*head, outcome.status, *cost, work, outcome.reason, cell.key))
    return pd.DataFrame(rows, columns=list(CELL_COLUMNS))
