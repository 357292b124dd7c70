"""Tables of a run, computed from its stored maps: no method runs again for a new metric."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from statistics import median

import numpy as np
import pandas as pd
from attrs import define, field, frozen
from numpy.typing import NDArray

from matbench.errors import UserError
from matbench.files.csv_tables import most_bytes, read_csv
from matbench.measures.confidence import ConfidenceMetric, RankedErrors, sparsification
from matbench.measures.metrics import Errors, Metric, score, signed_error_map, value_of
from matbench.measures.prediction import PredictionMetric, differences
from matbench.measures.volume_metrics import VolumeMetric, reliability, told
from matbench.measures.volumes import StoredVolume, rays_of
from matbench.plans.plan import Cell, Plan
from matbench.results.metric_catalogue import AnyMetric, wanted
from matbench.results.repeats import Repeats, judged
from matbench.runs.cell_files import Solved
from matbench.runs.outcome import DEVICE, Outcome
from matbench.runs.store import Store
from matbench.scene import Scene

RESULT_COLUMNS = (
    "algorithm",
    "params",
    "scene",
    "view",
    "seed",
    "region",
    "metric",
    "value",
    "unit",
    "pixels",
    "answered",
)
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
    "processor_seconds",
    "others_seconds",
    "doubt",
    "work",
    "reason",
    "cell",
    "machine",
    "maps",
    "repeats",
    "seconds_least",
    "seconds_most",
    *DEVICE,
)
_NUMBERS = (
    "seed",
    "seconds",
    "warmup_seconds",
    "peak_mb",
    "threads",
    "alone",
    "processor_seconds",
    "others_seconds",
    "seconds_least",
    "seconds_most",
    *DEVICE,
)
_LARGEST = 1e100
_AT_ONCE = 1 << 16  # rows
RELIABILITY_COLUMNS = ("algorithm", "params", "scene", "seed", "materiality", "observed", "points")
SPARSIFICATION_COLUMNS = ("algorithm", "params", "scene", "seed", "coverage", "risk", "best", "pixels")


@frozen(eq=False)
class Tables:
    """The tables of a run, from one pass over its stored cells.

    Parameters
    ----------
    results
        Columns `RESULT_COLUMNS`, one row for each cell with status ``ok``, region of the reference view and metric.
        Shares are in per cent of `pixels`, errors in pixels of the pair. Volumes have rows if they were kept. The
        prediction of a held-out view has rows of one region, ``all``, under that view's label. `answered` is the per
        cent of the pixels that the value is over; it is 100 if missing answers count against a method.
    cells
        Columns `CELL_COLUMNS`, one row for each cell that is scored: how it ended and what it cost. If a cell is
        solved several times, `seconds` is the median of the undisturbed solves, or of all if there are none. The
        shortest and the longest of them are `seconds_least` and `seconds_most`.
    reliability
        The reliability curve of every volume that was kept, over the reference view's known truth: algorithm, params,
        scene, seed, and the columns of `matbench.measures.volume_metrics.reliability`.
    sparsification
        The curve of risk over coverage of every confidence map, over the reference view's known truth: algorithm,
        params, scene, seed, and what `matbench.measures.confidence.sparsification` gives.
    unsteady
        The cells whose repeats differ, a line each.
    outcomes
        Key -> outcome, for each cell that is stored whole, repeats included.
    """

    results: pd.DataFrame
    cells: pd.DataFrame
    reliability: pd.DataFrame
    sparsification: pd.DataFrame
    unsteady: tuple[str, ...] = ()
    outcomes: Mapping[str, Outcome] = field(factory=dict)


@define
class _Rows:
    """A table while its rows are found: as tuples few of them are held at a time, as these take five times the room."""

    columns: Sequence[str]
    _parts: list[pd.DataFrame] = field(factory=list)
    _rows: list[tuple[object, ...]] = field(factory=list)

    def add(self, rows: Iterable[tuple[object, ...]]) -> None:
        self._rows += rows
        if len(self._rows) >= _AT_ONCE:
            self._settle()

    def table(self) -> pd.DataFrame:
        if self._rows or not self._parts:
            self._settle()
        return pd.concat(self._parts, ignore_index=True) if len(self._parts) > 1 else self._parts[0]

    def _settle(self) -> None:
        self._parts.append(pd.DataFrame(self._rows, columns=list(self.columns)))
        self._rows = []


def tables(plan: Plan, store: Store, scenes: Mapping[str, Scene], names: Sequence[str] = ()) -> Tables:
    """Score a run. Every cell is read only once, so that its rows in all tables belong to the same solve.

    Parameters
    ----------
    names
        Metrics besides those of every run (`wanted`).

    Raises
    ------
    UserError
        If a scene is not the one that was solved.
    """
    rows = _Rows(RESULT_COLUMNS)
    lines: list[tuple[object, ...]] = []
    curves: list[pd.DataFrame] = []
    risks: list[tuple[object, ...]] = []
    unsteady: list[str] = []
    outcomes: dict[str, Outcome] = {}
    used = wanted(names)

    def read(cell: Cell) -> Solved:
        scene = scenes[cell.scene]
        # what belongs to another scene is refused below, in words
        solved = store.read(cell, scene if scene.digest == cell.scene_digest else None)
        if solved.outcome is not None:
            outcomes[cell.key] = solved.outcome
        return solved

    for cell, *others in plan.questions:
        solved, scene = read(cell), scenes[cell.scene]
        # `map` reads the repeats one at a time: the maps of all of them might not fit into memory
        repeats = judged(cell, 1 + len(others), chain([solved], map(read, others))) if others else None
        lines.append(_line(solved, repeats))
        unsteady += [repeats.unsteady] if repeats is not None and repeats.unsteady else []
        if solved.maps:
            _check_scene(solved, scene)
            truth = scene.truth.get(scene.ref)
            error = None if truth is None else signed_error_map(solved.maps[scene.ref], truth, scene.pair_steps)
            rows.add(_scored(solved, scene, used, error))
            curves += _curve(solved, scene)
            risks += _risks(solved, scene, error)
    cells = pd.DataFrame(lines, columns=list(CELL_COLUMNS))
    # pandas would take a column without any number for one of objects; `read` takes it for one of numbers
    nowhere = [name for name in _NUMBERS if cells[name].isna().all()]
    return Tables(
        rows.table(),
        cells.astype(dict.fromkeys(nowhere, float)),
        pd.concat(curves, ignore_index=True) if curves else pd.DataFrame(columns=list(RELIABILITY_COLUMNS)),
        pd.DataFrame(risks, columns=list(SPARSIFICATION_COLUMNS)),
        tuple(unsteady),
        outcomes,
    )


def read(folder: Path, unsteady: tuple[str, ...], outcomes: Mapping[str, Outcome]) -> Tables:
    """The tables as they lie in a run folder: the same types as `tables` gave, and the same numbers to the last bit.

    Raises
    ------
    ValueError
        If one of them is damaged.
    """
    most = most_bytes(len(outcomes))
    return Tables(
        _read(folder / "results.csv", RESULT_COLUMNS, ("seed", "value", "pixels", "answered"), most),
        _read(folder / "cells.csv", CELL_COLUMNS, _NUMBERS, most),
        _read(folder / "reliability.csv", RELIABILITY_COLUMNS, RELIABILITY_COLUMNS[3:], most),
        _read(folder / "sparsification.csv", SPARSIFICATION_COLUMNS, SPARSIFICATION_COLUMNS[3:], most),
        unsteady,
        outcomes,
    )


def _read(path: Path, columns: Sequence[str], numbers: Sequence[str], most: int) -> pd.DataFrame:
    if not path.exists():
        return pd.DataFrame(columns=list(columns))
    table = read_csv(path, columns, most)
    return table.assign(**{name: [_number(text) for text in table[name]] for name in numbers})


def _number(text: str) -> float | bool:
    if text in ("True", "False"):
        return text == "True"
    number = int(text) if text.removeprefix("-").isdigit() else float(text or "nan")
    if abs(number) > _LARGEST:
        raise ValueError(f"{text} is no number that a table holds")
    return number


def _scored(
    solved: Solved, scene: Scene, metrics: Sequence[AnyMetric], error: Errors | None
) -> Iterator[tuple[object, ...]]:
    """A cell's rows of the table of results; `error` is its `signed_error_map`, None without truth."""
    estimate = solved.maps[scene.ref]
    if error is not None:
        yield from _of_maps(solved.cell, scene, estimate, [m for m in metrics if isinstance(m, Metric)], error)
    yield from _of_volumes(solved.cell, scene, solved.volume, [m for m in metrics if isinstance(m, VolumeMetric)])
    if error is not None:
        yield from _of_confidence(solved, scene, [m for m in metrics if isinstance(m, ConfidenceMetric)], error)
    if scene.held_out is not None:
        yield from _predicted(solved.cell, scene, estimate, [m for m in metrics if isinstance(m, PredictionMetric)])


def _check_scene(solved: Solved, scene: Scene) -> None:
    """Refuse to score maps against another scene than the one that was solved."""
    cell = solved.cell
    if scene.digest != cell.scene_digest:
        raise UserError(f"{cell.scene} is not what {cell.method} was given: it cannot be scored with the others")
    sizes = {values.shape for values in solved.maps.values()}
    if scene.ref not in solved.maps or sizes != {(scene.height, scene.width)}:
        raise UserError(f"{solved.place / 'disparity.npz'} holds no maps of {cell.scene}: remove {cell.key}")


def _head(cell: Cell, view: str, region: str) -> tuple[object, ...]:
    return *cell.method.names, cell.scene, view, cell.seed, region


def _of_maps(
    cell: Cell, scene: Scene, estimate: NDArray[np.float32], used: Sequence[Metric], error: Errors
) -> Iterator[tuple[object, ...]]:
    truth = scene.truth[scene.ref]
    for region, mask in scene.scored_regions.items():
        head = _head(cell, scene.labels[scene.ref], region)
        values = score(estimate, truth, mask, scene.pair_steps, used, scene, error)
        known = mask & np.isfinite(truth)
        pixels, answered = int(known.sum()), _percent(np.isfinite(estimate[known]))
        yield from ((*head, m.name, values[m.name], m.unit, pixels, _over(m, answered)) for m in used)


def _of_volumes(
    cell: Cell, scene: Scene, kept: StoredVolume | None, used: Sequence[VolumeMetric]
) -> Iterator[tuple[object, ...]]:
    if kept is None or scene.ref not in kept.views or scene.ref not in scene.truth:
        return
    masks = scene.scored_regions
    for region, rays in zip(masks, rays_of(kept, scene, masks.values()), strict=True):
        head, pixels = _head(cell, scene.labels[scene.ref], region), len(rays.surface)
        answered = told(rays) if pixels else float("nan")
        yield from ((*head, m.name, value_of(m, rays, pixels), m.unit, pixels, _over(m, answered)) for m in used)


def _of_confidence(
    solved: Solved, scene: Scene, used: Sequence[ConfidenceMetric], error: Errors
) -> Iterator[tuple[object, ...]]:
    if (sure := solved.confidence.get(scene.ref)) is None:
        return
    for region, mask in scene.scored_regions.items():
        known = mask & np.isfinite(scene.truth[scene.ref])
        ranked = RankedErrors.of(error[known], sure[known])
        head, pixels, count = _head(solved.cell, scene.labels[scene.ref], region), int(known.sum()), ranked.error.size
        answered = 100.0 * count / pixels if pixels else float("nan")
        yield from ((*head, m.name, value_of(m, ranked, count), m.unit, pixels, _over(m, answered)) for m in used)


def _risks(solved: Solved, scene: Scene, error: Errors | None) -> Iterator[tuple[object, ...]]:
    """The curve of risk over coverage of a cell's confidence, if it has one that can be judged."""
    cell, sure = solved.cell, solved.confidence.get(scene.ref)
    if sure is None or error is None:
        return
    for point in sparsification(RankedErrors.of(error, sure)):
        yield *cell.method.names, cell.scene, cell.seed, *point


def _predicted(
    cell: Cell, scene: Scene, estimate: NDArray[np.float32], used: Sequence[PredictionMetric]
) -> list[tuple[object, ...]]:
    assert scene.held_out is not None, "the caller has looked"  # noqa: S101
    found, head = differences(scene, estimate), _head(cell, scene.held_out.label, "all")
    answered = _percent(~np.isnan(found[:, 0]))
    return [(*head, m.name, value_of(m, found, len(found)), m.unit, len(found), _over(m, answered)) for m in used]


def _percent(mask: NDArray[np.bool_]) -> float:
    return 100.0 * float(mask.mean()) if mask.size else float("nan")


def _over(metric: AnyMetric, answered: float) -> float:
    """Per cent of the pixels that a metric is over."""
    return answered if metric.answered_only else 100.0


def _curve(solved: Solved, scene: Scene) -> list[pd.DataFrame]:
    """The reliability curve of a cell's volume, if it was kept and can be judged."""
    cell, kept = solved.cell, solved.volume
    if kept is None or scene.ref not in kept.views or scene.ref not in scene.truth:
        return []
    (rays,) = rays_of(kept, scene, [np.isfinite(scene.truth[scene.ref])])
    curve = reliability(rays)
    names = dict(zip(("algorithm", "params"), cell.method.names, strict=True))
    return [pd.DataFrame({**names, "scene": cell.scene, "seed": cell.seed}, index=curve.index).join(curve)]


def _log_of(place: Path) -> str:
    """A note where a cell's log lies, to follow its reason; empty if nothing was logged."""
    log = place / "log.txt"
    printed = log.is_file() and log.stat().st_size > 0
    return f" (log: cells/{place.name}/log.txt)" if printed else ""


def _line(solved: Solved, repeats: Repeats | None) -> tuple[object, ...]:
    """A cell's row of the table of cells."""
    cell, outcome, place = solved.cell, solved.outcome, solved.place
    head = (*cell.method.names, cell.scene, cell.seed)
    if outcome is None:
        return *head, "interrupted", *[None] * 7, "", "", "not computed yet", cell.key, "", "", "", *[None] * 4
    status, reason = outcome.status, outcome.reason
    if repeats is not None and repeats.failed is not None and status == "ok":
        repeat, failed = repeats.failed
        # `place` too: the log to read is that of the repeat
        status, reason, place = failed.status, f"repeat {repeat.repeat}: {failed.reason}", place.with_name(repeat.key)
    if reason and status != "skipped":
        reason += _log_of(place)
    told = (cell.key, outcome.ran_on.get("machine", ""), outcome.maps, str(repeats or ""))
    counted = repeats.timed if repeats is not None and repeats.timed else (outcome,)
    seconds = sorted(one.seconds for one in counted if one.seconds is not None)
    ends = (seconds[0], seconds[-1]) if len(seconds) > 1 else (None, None)
    taken = median(seconds) if seconds else None
    cost = (taken, outcome.warmup_seconds, outcome.peak_mb, outcome.threads, counted[0].alone)
    share = (outcome.processor_seconds, outcome.others_seconds, counted[0].doubt)
    work = " ".join(f"{name}={count}" for name, count in outcome.work.items())
    return *head, status, *cost, *share, work, reason, *told, *ends, outcome.device_seconds, outcome.device_mb
