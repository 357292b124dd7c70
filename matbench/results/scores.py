"""Tables of a run, computed from its stored maps: no method runs again for a new metric."""

from collections.abc import Iterator, Mapping
from functools import cache

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from matbench.errors import UserError
from matbench.measures.metrics import Metric, score, value_of
from matbench.measures.prediction import PredictionMetric, differences
from matbench.measures.volume_metrics import VolumeMetric, reliability
from matbench.measures.volumes import StoredVolume, rays_of
from matbench.plans import plugins
from matbench.plans.plan import Cell, Plan
from matbench.results.repeats import repeats
from matbench.runs.store import Store
from matbench.scene import Scene

AnyMetric = Metric | VolumeMetric | PredictionMetric

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
    "alone",
    "work",
    "reason",
    "cell",
    "machine",
    "maps",
    "repeats",
)


def metrics() -> tuple[AnyMetric, ...]:
    """Every metric that plug-ins offer, the built-in ones first; broken plug-ins are left out."""
    return _metrics()[0]


def broken_metrics() -> Mapping[str, str]:
    """The metric plug-ins that cannot be imported or give no new metrics, with what is wrong."""
    return _metrics()[1]


@cache
def _metrics() -> tuple[tuple[AnyMetric, ...], Mapping[str, str]]:
    found: dict[str, AnyMetric] = {}
    broken: dict[str, str] = {}
    by_source = sorted(plugins.installed("metrics").values(), key=lambda p: p.source != "matbench-stereo")
    for plugin in by_source:
        try:
            loaded = plugin.load()
            offered = [loaded] if isinstance(loaded, AnyMetric) else list(loaded)
        except (UserError, TypeError) as error:
            broken[plugin.name] = str(error)
            continue
        if all(isinstance(metric, AnyMetric) and metric.name not in found for metric in offered):
            found |= {metric.name: metric for metric in offered}
        else:
            broken[plugin.name] = f"plug-in {plugin.name!r} from {plugin.source} offers no Metric of a new name"
    return tuple(found.values()), broken


def of_volumes(name: str) -> bool:
    """Does a metric need the volumes of the cells?"""
    return any(metric.name == name and isinstance(metric, VolumeMetric) for metric in metrics())


def results(plan: Plan, store: Store, scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """One row for each finished cell, region of the reference view and metric.

    Columns are `RESULT_COLUMNS`: shares in per cent of `pixels`, errors in pixels of the pair.
    Volumes have rows where they were kept. The prediction of a view held out has one region,
    ``all``, and that view's label.

    Raises
    ------
    UserError
        If a scene is not the one that the maps are of.
    """
    rows: list[tuple[object, ...]] = []
    for cell in plan.scored:
        outcome = store.outcome(cell)
        if outcome is None or outcome.status != "ok":
            continue
        scene = scenes[cell.scene]
        _check_scene(cell, scene, store)
        rows += _of_maps(cell, scene, store.disparity(cell)[scene.ref])
        if outcome.has_volume:
            rows += _of_volumes(cell, scene, store.volume(cell))
        if scene.held_out is not None:
            rows += _predicted(cell, scene, store.disparity(cell)[scene.ref])
    return pd.DataFrame(rows, columns=list(RESULT_COLUMNS))


def _check_scene(cell: Cell, scene: Scene, store: Store) -> None:
    """Refuse to score maps against another scene than that which was solved."""
    if scene.digest != cell.scene_digest:
        raise UserError(f"{cell.scene} is not what {cell.method} was given: it cannot be scored with the others")
    maps = store.disparity(cell)
    sizes = {values.shape for values in maps.values()}
    if scene.ref not in maps or sizes != {(scene.height, scene.width)}:
        raise UserError(f"{store.cell(cell) / 'disparity.npz'} holds no maps of {cell.scene}: remove {cell.key}")


def _head(cell: Cell, view: str, region: str) -> tuple[object, ...]:
    return cell.method.algorithm, cell.method.changed, cell.scene, view, cell.seed, region


def _of_maps(cell: Cell, scene: Scene, estimate: NDArray[np.float32]) -> Iterator[tuple[object, ...]]:
    used = [metric for metric in metrics() if isinstance(metric, Metric)]
    for region, mask in scene.scored_regions.items():
        truth, head = scene.truth[scene.ref], _head(cell, scene.labels[scene.ref], region)
        values = score(estimate, truth, mask, scene.pair_steps, used)
        pixels = int((mask & np.isfinite(truth)).sum())
        yield from ((*head, m.name, values[m.name], m.unit, pixels) for m in used)


def _of_volumes(cell: Cell, scene: Scene, kept: StoredVolume | None) -> Iterator[tuple[object, ...]]:
    if kept is None or scene.ref not in kept.views or scene.ref not in scene.truth:
        return
    used = [metric for metric in metrics() if isinstance(metric, VolumeMetric)]
    masks = scene.scored_regions
    for region, rays in zip(masks, rays_of(kept, scene, masks.values()), strict=True):
        head, pixels = _head(cell, scene.labels[scene.ref], region), len(rays.surface)
        yield from ((*head, m.name, value_of(m, rays, pixels), m.unit, pixels) for m in used)


def _predicted(cell: Cell, scene: Scene, estimate: NDArray[np.float32]) -> list[tuple[object, ...]]:
    assert scene.held_out is not None, "the caller has looked"  # noqa: S101
    found, head = differences(scene, estimate), _head(cell, scene.held_out.label, "all")
    used = [metric for metric in metrics() if isinstance(metric, PredictionMetric)]
    return [(*head, m.name, value_of(m, found, len(found)), m.unit, len(found)) for m in used]


def reliabilities(plan: Plan, store: Store, scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """The reliability curve of every volume that was kept, over the reference view's known truth.

    Columns: algorithm, params, scene, seed, and those of `matbench.measures.volume_metrics.reliability`.
    """
    curves = []
    for cell in plan.scored:
        outcome, scene = store.outcome(cell), scenes[cell.scene]
        kept = store.volume(cell) if outcome is not None and outcome.has_volume else None
        if kept is None or scene.ref not in kept.views or scene.ref not in scene.truth:
            continue
        (rays,) = rays_of(kept, scene, [np.isfinite(scene.truth[scene.ref])])
        curve = reliability(rays)
        names = {"algorithm": cell.method.algorithm, "params": cell.method.changed}
        curves.append(pd.DataFrame({**names, "scene": cell.scene, "seed": cell.seed}, index=curve.index).join(curve))
    columns = ["algorithm", "params", "scene", "seed", "materiality", "observed", "points"]
    return pd.concat(curves, ignore_index=True) if curves else pd.DataFrame(columns=columns)


def _log_of(store: Store, cell: Cell) -> str:
    """Where a cell's log lies in the run folder, to stand after its reason; nothing if it has none."""
    log = store.cell(cell) / "log.txt"
    printed = log.is_file() and log.stat().st_size > 0
    return f" (log: {log.relative_to(store.folder).as_posix()})" if printed else ""


def cells(plan: Plan, store: Store) -> pd.DataFrame:
    """One row for each cell of the plan: what became of it and what it cost (`CELL_COLUMNS`)."""
    rows: list[tuple[object, ...]] = []
    repeated = repeats(plan, store)
    for cell in plan.scored:
        outcome = store.outcome(cell)
        head = (cell.method.algorithm, cell.method.changed, cell.scene, cell.seed)
        if outcome is None:
            rows.append((*head, "interrupted", *[None] * 5, "", "not computed yet", cell.key, "", "", ""))
            continue
        found = repeated.get(cell.key)
        status, reason, told_by = outcome.status, outcome.reason, cell
        if found is not None and found.failed is not None and status == "ok":
            told_by, failed = found.failed
            status, reason = failed.status, f"repeat {told_by.repeat}: {failed.reason}"
        if reason and status != "skipped":
            reason += _log_of(store, told_by)
        told = (cell.key, outcome.ran_on.get("machine", ""), outcome.maps, str(found or ""))
        cost = (outcome.seconds, outcome.warmup_seconds, outcome.peak_mb, outcome.threads, outcome.alone)
        work = " ".join(f"{name}={count}" for name, count in outcome.work.items())
        rows.append((*head, status, *cost, work, reason, *told))
    return pd.DataFrame(rows, columns=list(CELL_COLUMNS))
