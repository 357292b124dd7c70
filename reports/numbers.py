"""All numbers that a reader of the page can choose: the usual tables, for every metric and region."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from attrs import frozen

from matbench.measures.metrics import Better
from matbench.measures.statistics import Effect
from matbench.reports import costs, standing, tables
from matbench.reports.content import Report
from matbench.reports.standing import Difference
from matbench.reports.tables import EFFECT, METRIC, NOT_RANKED, REGION, THRESHOLD, Shared, interval, text
from matbench.results.comparable import SILENT
from matbench.runs.outcome import DEVICE

AT = "@"  # stands for the threshold in a family's name

_FIRST = ("total_bad_@", "bad_@", "invalid", "avg", "rms")

COSTS = {
    "seconds": ("s", f"{costs.CLOCK} time"),
    "peak_mb": ("MiB", "memory"),
    "device_seconds": ("s", "most device time as told"),
    "device_mb": ("MiB", "device memory as told"),
}
"""Column of the cells -> unit, and what it is called."""

SHOWN = 600
"""The most cells whose scores and maps are shown one by one: each takes some kilobytes of the page."""

Entry = list[Any]
"""[number or None, as shown, place, what is said beside it]: a cell of a table, in the template and in the script.

The place is 1 for the best, 2 for the second, `NOT_RANKED` for what is shown but not ranked, else 0. Nothing is said
beside most: then the last one is left out.
"""


@frozen(eq=False)
class Numbers:
    """Every table of a run; the page's template and script take theirs from here.

    Parameters
    ----------
    scope
        The methods, in the order in which they are shown, and their scenes.
    """

    report: Report
    scope: Shared

    @cached_property
    def units(self) -> dict[str, str]:
        return tables.metrics(self.report.results)

    @cached_property
    def regions(self) -> list[str]:
        return tables.regions(self.report.results)

    @property
    def metric(self) -> str:
        """The metric that is shown first."""
        for name in (self.report.metric, METRIC):
            if name in self.units or not self.units:
                return name
        return next(iter(self.units))

    @property
    def region(self) -> str:
        return REGION if REGION in self.regions or not self.regions else self.regions[0]

    @cached_property
    def thresholds(self) -> list[str]:
        """The thresholds in the metrics' names, as they are written there, increasing."""
        found = {hit[2] for name in self.units if (hit := THRESHOLD.fullmatch(name))}
        return sorted(found, key=float)

    @cached_property
    def scores(self) -> list[str]:
        """The metrics; those with several thresholds once, as ``total_bad_@``, and total_bad before bad."""
        names = [THRESHOLD.sub(rf"\1_{AT}", name) for name in self.units]
        first = [f"{family}_{AT}" for family in ("total_bad", "bad") if f"{family}_{AT}" in names]
        return list(dict.fromkeys(first + names))

    @cached_property
    def columns(self) -> list[str]:
        """Columns of the first table: the main scores, then the costs, then all other scores."""
        first = [s for s in self.scores if s in _FIRST]
        return [*first, *self.costs, *(s for s in self.scores if s not in first)]

    def score(self, metric: str) -> str:
        """The score that a metric belongs to.

        ``total_bad_1`` belongs to ``total_bad_@``.
        """
        return THRESHOLD.sub(rf"\1_{AT}", metric)

    @property
    def threshold(self) -> str:
        hit = THRESHOLD.fullmatch(self.metric)
        return hit[2] if hit else (self.thresholds or [""])[0]

    def metric_of(self, score: str) -> str:
        """The metric of a score at the first threshold."""
        return score.replace(AT, self.threshold)

    def better(self, metric: str) -> Better:
        """Which direction of a metric is."""
        return self.report.better.get(metric, "lower")

    @cached_property
    def _tables(self) -> Mapping[tuple[str, str], pd.DataFrame]:
        """(metric, region) -> scenes x methods."""
        return self._of("value")

    @cached_property
    def _answered(self) -> Mapping[tuple[str, str], pd.DataFrame]:
        """(metric, region) -> scenes x methods: per cent of the pixels that the scores are over."""
        return self._of("answered")

    def _of(self, column: str) -> Mapping[tuple[str, str], pd.DataFrame]:
        found = tables.every_scene(self.report.results, column)
        scenes, methods = list(self.scope.asked), list(self.scope.methods)
        nothing = pd.DataFrame(np.nan, index=scenes, columns=methods)
        both = [(m, r) for m in self.units for r in self.regions]
        return {one: found.get(one, nothing).reindex(index=scenes, columns=methods) for one in both}

    @cached_property
    def _ranked(self) -> pd.Series:
        return pd.Series({m: self.scope.is_ranked(m) for m in self.scope.methods}, dtype=bool)

    def _by_metric(self, make: Any) -> dict[str, dict[str, Any]]:
        """Metric -> region -> what is made of its name, its scores and what these are over."""
        every = {m: {r: (self._tables[m, r], self._answered[m, r]) for r in self.regions} for m in self.units}
        return {m: {r: make(m, *both) for r, both in by_region.items()} for m, by_region in every.items()}

    @cached_property
    def counts(self) -> dict[str, dict[str, int]]:
        """Metric -> region -> how many scenes the means of the ranked methods are over."""
        return self._by_metric(lambda _metric, table, _answered: tables.count(table, self.scope))

    @cached_property
    def aside(self) -> dict[str, dict[str, list[str]]]:
        """Metric -> region -> the methods that answer too little to be ranked by it."""
        return self._by_metric(
            lambda _metric, _table, answered: list(tables.too_silent(tables.over_scenes(answered, self.scope)))
        )

    @cached_property
    def means(self) -> dict[str, dict[str, dict[str, Entry]]]:
        """Metric -> region -> method -> entry."""

        def make(metric: str, table: pd.DataFrame, answered: pd.DataFrame) -> dict[str, Entry]:
            means, over = (tables.over_scenes(part, self.scope) for part in (table, answered))
            return entries(means, self._ranked, self.units[metric], self.better(metric), over)

        return self._by_metric(make)

    @cached_property
    def ranks(self) -> dict[str, dict[str, dict[str, Entry]]]:
        """Metric -> region -> method -> entry with its mean rank."""

        def make(metric: str, table: pd.DataFrame, answered: pd.DataFrame) -> dict[str, Entry]:
            aside = tables.too_silent(tables.over_scenes(answered, self.scope))
            ranks = standing.mean_ranks(table, self.scope, self.units[metric], self.better(metric), aside)
            return entries(pd.Series(ranks, dtype=float), self._ranked, "%")

        return self._by_metric(make)

    def ranking(self, metric: str, region: str) -> standing.Ranking | None:
        """The mean ranks with their critical difference."""
        table, aside = self._tables[metric, region], self.aside[metric][region]
        return standing.ranking(table, self.scope, self.units[metric], self.better(metric), aside)

    @cached_property
    def shown(self) -> tuple[str, ...]:
        """The scenes that are shown one by one: all, or as many as `SHOWN` allows, evenly from the easiest on.

        How easy a scene is tells the mean of the first metric over all methods.
        """
        asked, most = self.scope.asked, max(1, SHOWN // max(1, len(self.scope.methods)))
        if len(asked) <= most:
            return asked
        means = tables.merit(self._tables[self.metric, self.region], self.better(self.metric)).mean(axis=1)
        order = means.fillna(np.inf).sort_values(kind="stable").index
        chosen = {str(order[place]) for place in np.linspace(0, len(order) - 1, most).round().astype(int)}
        return tuple(scene for scene in asked if scene in chosen)

    @cached_property
    def scenes(self) -> dict[str, dict[str, list[list[Entry]]]]:
        """Metric -> region -> `shown` x methods of entries; the status stands where a cell did not end well."""
        bad = self.report.cells[self.report.cells["status"] != "ok"]
        status = {(m, s): state for m, s, state in zip(bad["method"], bad["scene"], bad["status"], strict=True)}
        methods, nothing = self.scope.methods, float("nan")
        has = {s: {m: s in self.scope.has[m] for m in methods} for s in self.shown}

        def make(metric: str, table: pd.DataFrame, answered: pd.DataFrame) -> list[list[Entry]]:
            out, unit, better = [], self.units[metric], self.better(metric)
            rows = (part.loc[list(self.shown)].to_numpy(float).tolist() for part in (table, answered))
            for scene, *both in zip(self.shown, *rows, strict=True):
                here = has[scene]
                values, over = (
                    {m: v if here[m] else nothing for m, v in zip(methods, row, strict=True)} for row in both
                )
                found = _entries(values, here, unit, better, over)
                found |= {m: [None, str(status[m, scene]), 0] for m in methods if (m, scene) in status}
                out.append([found[m] for m in methods])
            return out

        return self._by_metric(make)

    @cached_property
    def differences(self) -> dict[str, dict[str, list[Difference]]]:
        """Metric -> region -> differences between the ranked methods; between magnitudes where zero is best."""
        merits = [table.abs() if self.better(m) == "zero" else table for (m, _), table in self._tables.items()]
        found = iter(standing.differences(merits, self.scope))
        return self._by_metric(lambda *_: next(found))

    @cached_property
    def costs(self) -> dict[str, dict[str, Entry]]:
        """What it cost, by name of the column of the cells."""
        found = {}
        if "seconds" in self.report.cells:
            times = self.times
            found["seconds"] = entries(times["seconds"], self._ranked & times["alike"].astype(bool), "s")
            for method, row in times.iterrows():
                ends = f"{text(row['least'], 's')} .. {text(row['most'], 's')}" if pd.notna(row["least"]) else ""
                is_aside = not row["alike"] and pd.notna(row["seconds"])
                said = [ends, "not ranked" if is_aside else ""]
                entry = found["seconds"][str(method)]
                entry[2] = NOT_RANKED if is_aside else entry[2]
                entry += ["; ".join(filter(None, said))] if any(said) else []
        if "peak_mb" in self.report.cells:
            memory = costs.memory(self.report.cells, self.scope)
            found["peak_mb"] = entries(memory, self._ranked, "MiB")
        for name in DEVICE:  # methods say it of themselves: it is shown, not ranked
            if name in self.report.cells and self.report.cells[name].notna().any():
                most = costs.memory(self.report.cells, self.scope, name)
                found[name] = entries(most, self._ranked & False, COSTS[name][0])
        return found

    @cached_property
    def times(self) -> pd.DataFrame:
        """As `matbench.reports.costs.seconds` makes them."""
        return costs.seconds(self.report.cells, self.scope)

    def count(self, column: str) -> int:
        """How many scenes a column of the first table is over."""
        return len(self.scope.scenes) if column in COSTS else self.counts[self.metric_of(column)][self.region]

    def against(self, metric: str, region: str, reference: str | None = None) -> list[dict[str, Any]]:
        """The table of differences from a reference, by default the best method; a line for each ranked method."""
        found = self.differences[metric][region] if self.units else []
        means = self.means[metric][region] if self.units else {}
        known = standing.references(self.scope)
        aside = self.aside[metric][region] if self.units else []
        if reference is None:
            values = {m: means[m][0] for m in known if means[m][0] is not None and m not in aside}
            reference = min(values, key=lambda m: tables.merit(values[m], self.better(metric)), default=None)
        effects = standing.against(found, reference, self.scope) if reference is not None else {}
        parts = [v for effect in effects.values() for v in _ends(effect)]
        left, right = min(0.0, *parts, 0.0), max(0.0, *parts, 0.0)
        width = right - left or 1.0
        return [
            {
                "method": method,
                "reference": reference,
                "mean": text(effect.mean, "%", signed=True),
                "interval": interval(effect.low, effect.high),
                "size": text(effect.size, EFFECT, signed=True),
                "scenes": effect.scenes,
                "verdict": SILENT
                if {method, reference} & set(aside)
                else standing.words(standing.told(effect), self.better(metric) == "higher"),
                "bar": [round(3 + 94 * (v - left) / width, 2) for v in (*_ends(effect), 0.0)],
            }
            for method, effect in effects.items()
        ]

    def data(self) -> dict[str, Any]:
        """The numbers that the page's script needs, for JSON; None in place of NaN."""
        place = {m: i for i, m in enumerate(self.scope.methods)}
        return {
            "methods": list(self.scope.methods),
            "asked": list(self.shown),
            "regions": self.regions,
            "units": self.units,
            "better": {m: self.better(m) for m in self.units},
            "means": self.means,
            "ranks": self.ranks,
            "scenes": self.scenes,
            "counts": self.counts,
            "aside": {m: {r: some for r, some in found.items() if some} for m, found in self.aside.items()},
            "silent": SILENT,
            "references": standing.references(self.scope),
            "differences": {
                m: {
                    r: [[place[d.method], place[d.reference], *_numbers(d.effect)] for d in found]
                    for r, found in by_region.items()
                }
                for m, by_region in self.differences.items()
            },
        }


def entries(
    values: pd.Series, ranked: pd.Series, unit: str, better: Better = "lower", answered: pd.Series | None = None
) -> dict[str, Entry]:
    """Method -> entry.

    Parameters
    ----------
    answered
        Method -> per cent of the pixels that its value is over: it is told, and who has too little gets no place.
    """
    # with plain numbers: a page asks for thousands of entries, and pandas takes a millisecond for each
    return _entries(_plain(values), _plain(ranked), unit, better, {} if answered is None else _plain(answered))


def _plain(series: pd.Series) -> dict[str, Any]:
    return dict(zip(map(str, series.index), series.tolist(), strict=True))


def _entries(
    values: Mapping[str, float], ranked: Mapping[str, bool], unit: str, better: Better, answered: Mapping[str, float]
) -> dict[str, Entry]:
    over = {name: answered.get(name, float("nan")) for name in values}
    aside = tables.silent_ones(over)
    shown = {name: text(value, unit) for name, value in values.items()}
    placed = [name for name in values if ranked[name] and name not in aside]
    marks = tables.places_of({name: shown[name] for name in placed}, better)
    out: dict[str, Entry] = {}
    for name, value in values.items():
        out[name] = [_sortable(value), shown[name], marks.get(name, 0)]
        if (answers := over[name]) < 100 and value == value:
            said = f"{tables.share(answers)} answered"
            out[name].append(f"{said}, not ranked" if name in aside else said)
            out[name][2] = NOT_RANKED if name in aside else out[name][2]
    return out


def _sortable(value: float) -> float | None:
    """A number that JSON can hold; the largest one for infinity, None where there is none."""
    if value != value:
        return None
    return float(f"{min(max(value, -1e300), 1e300):.8g}")


def _ends(effect: Effect) -> tuple[float, float, float]:
    mean = effect.mean if np.isfinite(effect.mean) else 0.0
    low, high = (v if np.isfinite(v) else mean for v in (effect.low, effect.high))
    return low, mean, high


def _numbers(effect: Effect) -> list[float | int | str | None]:
    """Mean, low and high, the scenes; then mean, low, high, size and verdict as shown: a browser would round again."""
    found = (effect.mean, effect.low, effect.high)
    shown = (text(v, "%", signed=True) for v in found)
    numbers = (float(f"{v:.4g}") if np.isfinite(v) else None for v in found)
    return [*numbers, effect.scenes, *shown, text(effect.size, EFFECT, signed=True), standing.told(effect)]
