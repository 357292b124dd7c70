"""The tables of a run. Page, terminal and papers all take their numbers from here, so that they agree."""

import re
from collections.abc import Mapping, Sequence
from math import floor
from typing import TypeVar

import numpy as np
import pandas as pd
from attrs import frozen

from matbench.measures.metrics import ENOUGH, Better
from matbench.regions import VIEW_REGIONS
from matbench.reports import costs
from matbench.reports.mixture import mixture
from matbench.results.comparable import counted, is_enough
from matbench.spec import witness

METRIC, REGION = "total_bad_1", "all"
THRESHOLD = re.compile(r"(bad|total_bad)_(\d+(?:\.\d+)?)")
"""Metrics that have a threshold in their name, in px of the pair."""

REGIONS = ("nonocc", "all", "occ", "disc", "textureless")
VIEWS = tuple(VIEW_REGIONS)
Numbers = TypeVar("Numbers", float, pd.Series, pd.DataFrame)

NO_NUMBER = "–"
COUNTED = "counted"
EFFECT = "d"
"""The unit of effect sizes, Cohen's d: how many standard deviations."""

ASIDE = "*"
"""Follows a number that is shown, but not ranked; a note says why."""

NOT_RANKED = -1
"""The place of such a number."""

_NO_SCENES: frozenset[str] = frozenset()


def label(algorithm: str, params: str) -> str:
    """The name of a method, the same everywhere.

    >>> label("sgbm", ""), label("sgbm", "fill=False")
    ('sgbm', 'sgbm[fill=False]')
    """
    return f"{algorithm}[{params}]" if params else algorithm


def labelled(frame: pd.DataFrame) -> pd.DataFrame:
    """`results` or `cells` with a further column, `method`; also if they were read from a file.

    Results have one more, which rows enter means (`matbench.results.comparable.counted`): it takes long to find.
    """
    if "method" in frame:
        return frame
    out = frame.copy()
    out["params"] = out["params"].astype(object).where(out["params"].notna(), "").astype(str)
    names = list(zip(*(out[name].to_numpy(object) for name in ("algorithm", "params")), strict=True))
    labels = {both: label(*both) for both in set(names)}
    out["method"] = np.array([labels[both] for both in names], object)
    if "seed" not in out:
        out["seed"] = 0
    if "value" in out and "answered" not in out:
        out["answered"] = np.nan  # nobody knows
    if {"scene", "region", "metric", "value", "pixels"} <= set(out.columns):
        out[COUNTED] = counted(out)
    texts = out.columns.intersection(["method", "scene", "unit", "status"])
    chosen_by = out.columns.intersection(["region", "metric"])  # again and again, in a table of a million rows
    return out.astype(dict.fromkeys(texts, object) | dict.fromkeys(chosen_by, "category"))


@frozen
class Shared:
    """Which methods can be compared, and on which scenes.

    Parameters
    ----------
    methods
        All of them, in the order of the plan.
    asked
        All scenes of the plan.
    has
        Method -> the scenes on which all its cells are ok and scored.
    scenes
        The scenes that the methods with the most scenes share; means are taken over these.
    """

    methods: tuple[str, ...]
    asked: tuple[str, ...]
    has: Mapping[str, frozenset[str]]
    scenes: tuple[str, ...]

    @property
    def distinct(self) -> int:
        """How many different shared scenes there are; one scene with several options counts once."""
        return len(set(map(witness, self.scenes)))

    @property
    def mixture(self) -> str:
        """How many of the shared scenes are of which kind, as every scene weighs the same; empty if all are of one."""
        return mixture(self.scenes)

    def is_ranked(self, method: str) -> bool:
        """Has the method every shared scene? Only then is it compared with the others."""
        return bool(self.scenes) and self.has[method].issuperset(self.scenes)

    def counted(self, method: str) -> tuple[str, ...]:
        """The scenes of a method's means: the shared ones, or its own if it lacks some of them."""
        return self.scenes if self.is_ranked(method) else tuple(s for s in self.asked if s in self.has[method])


def shared(results: pd.DataFrame, cells: pd.DataFrame) -> Shared:
    """Find the scenes that the methods share. A method lacks a scene if one of its cells there is not ok."""
    scored, planned = labelled(results), labelled(cells)
    methods = tuple(dict.fromkeys([*planned["method"].unique(), *scored["method"].unique()]))
    asked = tuple(dict.fromkeys([*planned["scene"].unique(), *scored["scene"].unique()]))
    done = scored[["method", "scene"]].drop_duplicates()
    pairs = set(zip(done["method"], done["scene"], strict=True))
    bad = planned[planned["status"] != "ok"]
    pairs -= set(zip(bad["method"], bad["scene"], strict=True))
    has = {m: frozenset(s for s in asked if (m, s) in pairs) for m in methods}
    most = max((len(h) for h in has.values()), default=0)
    common = frozenset.intersection(*(h for h in has.values() if len(h) == most)) if has else _NO_SCENES
    return Shared(methods, asked, has, tuple(s for s in asked if s in common))


def regions(results: pd.DataFrame) -> list[str]:
    """The regions that were scored, the field's own first, then those over all views."""
    found, known = list(results["region"].unique()), (*REGIONS, *VIEWS)
    return [r for r in known if r in found] + [r for r in found if r not in known]


def summarised(results: pd.DataFrame) -> list[str]:
    """The regions that the summary shows: the field's five, and those over all views that were scored."""
    return [*REGIONS, *(r for r in regions(results) if r in VIEWS)]


def metrics(results: pd.DataFrame) -> dict[str, str]:
    """Metric -> unit, in the order of the results."""
    found = results[["metric", "unit"]].drop_duplicates("metric")
    return dict(zip(found["metric"], found["unit"].fillna(""), strict=True))


def per_scene(results: pd.DataFrame, region: str, metric: str, column: str = "value") -> pd.DataFrame:
    """Scores of one metric in one region: scenes x methods, the mean over seeds, NaN where there is none.

    A seed without a value leaves its scene without one: it is not averaged away. Scenes in which the region holds too
    few pixels (`matbench.results.comparable.counted`) have none.

    Parameters
    ----------
    column
        ``"answered"`` for the per cent of the pixels that the scores are over.
    """
    scored = labelled(results)
    rows = scored[(scored["metric"] == metric) & (scored["region"] == region)]
    rows = rows[rows[COUNTED].to_numpy(bool)]
    return _wide(rows, ["scene", "method"], column).reindex(
        index=pd.Index(scored["scene"].unique(), name="scene"),
        columns=pd.Index(scored["method"].unique(), name="method"),
    )


def every_scene(results: pd.DataFrame, column: str = "value") -> dict[tuple[str, str], pd.DataFrame]:
    """(metric, region) -> the table that `per_scene` makes, for all of them at once."""
    scored = labelled(results)
    wide = _wide(
        scored[scored[COUNTED].to_numpy(bool)].astype({"metric": object, "region": object}),
        ["metric", "region", "scene", "method"],
        column,
    )
    scenes, methods = scored["scene"].unique(), scored["method"].unique()
    return {
        (str(metric), str(region)): part.droplevel(["metric", "region"]).reindex(index=scenes, columns=methods)
        for (metric, region), part in wide.groupby(level=["metric", "region"], sort=False)
    }


def _wide(rows: pd.DataFrame, keys: list[str], column: str) -> pd.DataFrame:
    groups = rows.assign(number=rows[column].astype(float)).groupby(keys, sort=False)["number"]
    return groups.mean().where(groups.count() == groups.size()).unstack("method")


def means(results: pd.DataFrame, scope: Shared, region: str, metric: str, column: str = "value") -> pd.Series:
    """Method -> mean over the scenes it is counted on; NaN where one of them has no value.

    Scenes in which the region counts for no method are left out.
    """
    return over_scenes(per_scene(results, region, metric, column), scope)


def over_scenes(table: pd.DataFrame, scope: Shared) -> pd.Series:
    """`means` of a table that `per_scene` made."""
    # with arrays: a page asks for hundreds of means, and pandas takes a millisecond for each
    values = like(table, scope.asked, scope.methods).to_numpy(float)
    filled = {scene for scene, row in zip(scope.asked, values, strict=True) if not np.isnan(row).all()}
    places = {scene: number for number, scene in enumerate(scope.asked)}
    found = {}
    for number, method in enumerate(scope.methods):
        rows = [places[scene] for scene in scope.counted(method) if scene in filled]
        found[method] = values[rows, number].mean() if rows else np.nan
    return pd.Series(list(found.values()), pd.Index(list(found), dtype=object), dtype=float)


def like(table: pd.DataFrame, scenes: Sequence[str], methods: Sequence[str]) -> pd.DataFrame:
    """A table with these rows and columns: itself, where it has them."""
    if list(table.index) == list(scenes) and list(table.columns) == list(methods):
        return table
    return table.reindex(index=list(scenes), columns=list(methods))


def count(table: pd.DataFrame, scope: Shared) -> int:
    """How many scenes the means of the ranked methods are over, in a table that `per_scene` made."""
    return int(table.reindex(index=list(scope.scenes)).notna().any(axis=1).sum())


def too_silent(answered: pd.Series) -> dict[str, float]:
    """The methods whose scores are over too little to be ranked (`matbench.measures.metrics.ENOUGH`).

    Parameters
    ----------
    answered
        Method -> per cent of the pixels that its scores are over.
    """
    return silent_ones({str(m): float(share) for m, share in answered.items()})


def silent_ones(answered: Mapping[str, float]) -> dict[str, float]:
    """`too_silent` of plain numbers."""
    return {method: share for method, share in answered.items() if not is_enough(share)}


def aside_note() -> str:
    """What `ASIDE` after a score means."""
    return f"{ASIDE} over answered pixels only, and fewer than {ENOUGH:g} % are answered: shown, not ranked"


def answers(results: pd.DataFrame, scope: Shared) -> pd.Series:
    """Method -> per cent of the pixels that it answers in `all`, or predicts, mean over the scenes it is counted on."""
    return over_scenes(_answers(results), scope)


def _answers(results: pd.DataFrame) -> pd.DataFrame:
    if "invalid" in set(results["metric"]):
        return 100 - per_scene(results, REGION, "invalid")
    return per_scene(results, REGION, "prediction_coverage")


def silences(results: pd.DataFrame, scope: Shared) -> dict[str, str]:
    """Method -> what is to be said of it if there are scenes on which it answers nothing at all."""
    silent = (_answers(results) == 0).sum()
    counts = {m: (int(silent.get(m, 0)), len(scope.has[m])) for m in scope.methods}
    return {
        m: "no answer anywhere" if some == of else f"no answer at all on {some} of {of} scenes"
        for m, (some, of) in counts.items()
        if some
    }


def summary(results: pd.DataFrame, cells: pd.DataFrame, metric: str = METRIC, better: Better = "lower") -> pd.DataFrame:
    """Methods x means, best first by `metric` in `all`.

    Parameters
    ----------
    results, cells
        The two tables of a run.
    metric
        The metric that is shown for every region.
    better
        Which direction of it is better.

    Returns
    -------
    Index: the methods' labels. Columns: ``<metric> <region>`` for `summarised` regions, ``avg all``
    (pixels of the pair), ``seconds`` (`matbench.reports.costs.seconds`), then ``scenes`` (how many the means are
    over), ``asked`` (how many it was asked for) and ``ranked``. Ranked methods share their scenes; a method that
    lacks one of these has means over its own scenes and is not ranked; nor is one whose scores are over too little
    (`too_silent`), if `metric` is over answered pixels only. ``alike``: may its seconds be ranked? ``answers``: per
    cent of the pixels that it answers in `all`. ``remark``: why it is not ranked, and what it leaves unanswered.
    """
    scope = shared(results, cells)
    columns = {f"{metric} {region}": means(results, scope, region, metric) for region in summarised(results)}
    columns["avg all"] = means(results, scope, REGION, "avg")
    times = costs.seconds(labelled(cells), scope)
    columns["seconds"] = times["seconds"]
    out = pd.DataFrame(columns, index=pd.Index(scope.methods, name="method", dtype=str), dtype=float)
    out["scenes"] = [len(scope.counted(m)) for m in scope.methods]
    out["asked"] = len(scope.asked)
    silent = too_silent(means(results, scope, REGION, metric, "answered"))
    ranked = [scope.is_ranked(m) and m not in silent for m in scope.methods]
    out["ranked"] = pd.Series(ranked, out.index, dtype=bool)
    out["alike"] = times["alike"].astype(bool)
    out["answers"] = answers(results, scope)
    out["remark"] = pd.Series(_remarks(out, scope, silences(results, scope)), dtype=object).reindex(out.index)
    by = {"unranked": ~out["ranked"], "merit": merit(out[f"{metric} {REGION}"], better)}
    order = out.assign(**by).sort_values(list(by), kind="stable")
    return out.loc[order.index]


def none_scored(cells: pd.DataFrame) -> str:
    """Why a run has no score at all, in a line: what became of its cells, and why the first has none."""
    statuses = ", ".join(f"{count} {status}" for status, count in cells["status"].value_counts().items())
    if not statuses:
        return "no cell of this run has a score: there are no cells"
    first = labelled(cells).iloc[0]
    reason = first.get("reason")
    why = f": {reason}" if isinstance(reason, str) and reason else ""
    return f"no cell of this run has a score ({statuses}): {first['method']} on {first['scene']}{why}"


def merit(values: Numbers, better: Better) -> Numbers:
    """Numbers of which less is better, whichever of the values are.

    >>> merit(-2.0, "lower"), merit(-2.0, "higher"), merit(-2.0, "zero")
    (-2.0, 2.0, 2.0)
    """
    return -values if better == "higher" else abs(values) if better == "zero" else values


def _remarks(rows: pd.DataFrame, scope: Shared, silent: Mapping[str, str]) -> dict[str, str]:
    """What stands below each method's name."""
    found = {}
    for method, row in rows.iterrows():
        said = [] if row["ranked"] else ["not ranked"]
        if not scope.is_ranked(str(method)):
            said = [f"not ranked: {row['scenes']} of {row['asked']} scenes"]
        if 0 < row["answers"] < 100:
            said.append(f"answers {share(row['answers'])}")
        said += [silent[str(method)]] if str(method) in silent else []
        found[str(method)] = "; ".join(said)
    return found


def text(value: float, unit: str, signed: bool = False) -> str:
    """A number as every table shows it: in at most eight characters, nine with a sign.

    >>> text(2.345, "%"), text(0.01234, "s"), text(float("nan"), "px"), text(4.63e35, "px"), text(float("inf"), "px")
    ('2.35', '0.012', '–', '4.6e+35', 'inf')
    >>> text(2.345, "%", signed=True), text(-123456, "px", signed=True), text(-0.0, "s", signed=True)
    ('+2.35', '-1.2e+05', '+0.000')
    """
    if value != value if isinstance(value, float) else pd.isna(value):  # `pandas.isna` takes ten times as long
        return NO_NUMBER
    sign, size = "+" if signed else "", abs(value)
    if np.isinf(value):
        return f"{value:{sign}}"
    if size >= 99999.995:
        return f"{value:{sign}.1e}"
    if unit in ("%", "px"):
        return f"{value + 0.0:{sign}.2f}"
    if unit == EFFECT:
        return f"{value + 0.0:{sign}.1f}"
    if unit == "s":
        return f"{value + 0.0:{sign}.{0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3}f}"
    return f"{value + 0.0:{sign}.3g}" if size < 1e-4 else f"{value + 0.0:{sign}.4g}"


def interval(low: float, high: float) -> str:
    """The ends of an interval, as shown everywhere.

    >>> interval(-0.98, 3.17), interval(float("nan"), float("nan"))
    ('-0.98 .. +3.17', '–')
    """
    return f"{text(low, '%', signed=True)} .. {text(high, '%', signed=True)}" if np.isfinite(low) else "–"


def share(answered: float) -> str:
    """Per cent of the pixels, never rounded up: less than all is not called all.

    >>> share(100), share(99.97), share(0.98), share(0)
    ('100 %', '99.9 %', '0.9 %', '0 %')
    """
    return f"{floor(answered * 10 + 1e-9) / 10:g} %"


def places(values: pd.Series, unit: str, better: Better = "lower") -> pd.Series:
    """1 for the best, 2 for the second best, else 0, by the numbers as shown: ties share a place.

    Nothing is marked where all are equal or only one has a value.
    """
    marks = places_of({str(method): text(value, unit) for method, value in values.items()}, better)
    return pd.Series(list(marks.values()), values.index)


def places_of(shown: Mapping[str, str], better: Better = "lower") -> dict[str, int]:
    """`places` of numbers as they are shown, by method.

    >>> places_of({"a": "1.00", "b": "1.00", "c": "2.00", "d": "–"})
    {'a': 1, 'b': 1, 'c': 0, 'd': 0}
    """
    numbers = {method: merit(float(told), better) for method, told in shown.items() if told != NO_NUMBER}
    if len(set(numbers.values())) < 2:
        return dict.fromkeys(shown, 0)
    ahead = {method: sum(other < own for other in numbers.values()) for method, own in numbers.items()}
    return {method: ahead[method] + 1 if ahead.get(method, 2) < 2 else 0 for method in shown}
