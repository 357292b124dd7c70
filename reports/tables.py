"""The tables of a run. Page, terminal and papers all take their numbers from here, so that they agree."""

from collections.abc import Mapping
from typing import TypeVar

import pandas as pd
from attrs import frozen

from matbench.measures.metrics import Better
from matbench.regions import VIEW_REGIONS
from matbench.spec import read_scene

METRIC, REGION = "total_bad_1", "all"
REGIONS = ("nonocc", "all", "occ", "disc", "textureless")
VIEWS = tuple(VIEW_REGIONS)
Numbers = TypeVar("Numbers", float, pd.Series, pd.DataFrame)

_NO_SCENES: frozenset[str] = frozenset()


def label(algorithm: str, params: str) -> str:
    """The name of a method, the same everywhere.

    >>> label("sgbm", ""), label("sgbm", "fill=False")
    ('sgbm', 'sgbm[fill=False]')
    """
    return f"{algorithm}[{params}]" if params else algorithm


def labelled(frame: pd.DataFrame) -> pd.DataFrame:
    """`results` or `cells` with a further column, `method`; also if they were read from a file."""
    if "method" in frame:
        return frame
    out = frame.copy()
    out["params"] = out["params"].astype(object).where(out["params"].notna(), "").astype(str)
    out["method"] = [label(a, p) for a, p in zip(out["algorithm"], out["params"], strict=True)]
    if "seed" not in out:
        out["seed"] = 0
    names = out.columns.intersection(["method", "scene", "region", "metric", "unit", "status"])
    return out.astype(dict.fromkeys(names, object))


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
        return len({read_scene(scene).name for scene in self.scenes})

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


def per_scene(results: pd.DataFrame, region: str, metric: str) -> pd.DataFrame:
    """Scores of one metric in one region: scenes x methods, the mean over seeds, NaN where there is none.

    A seed without a value leaves its scene without one: it is not averaged away.
    """
    scored = labelled(results)
    rows = scored[(scored["region"] == region) & (scored["metric"] == metric)]
    groups = rows.assign(value=rows["value"].astype(float)).groupby(["scene", "method"])["value"]
    means = groups.mean().where(groups.count() == groups.size()).unstack("method")
    scenes, methods = scored["scene"].unique(), scored["method"].unique()
    return means.reindex(index=scenes, columns=methods).rename_axis(index="scene", columns="method")


def every_scene(results: pd.DataFrame) -> dict[tuple[str, str], pd.DataFrame]:
    """(metric, region) -> the table that `per_scene` makes, for all of them at once."""
    scored = labelled(results)
    keys = ["metric", "region", "scene", "method"]
    groups = scored.assign(value=scored["value"].astype(float)).groupby(keys, sort=False)["value"]
    wide = groups.mean().where(groups.count() == groups.size()).unstack("method")
    scenes, methods = scored["scene"].unique(), scored["method"].unique()
    return {
        (str(metric), str(region)): part.droplevel(["metric", "region"]).reindex(index=scenes, columns=methods)
        for (metric, region), part in wide.groupby(level=["metric", "region"], sort=False)
    }


def means(results: pd.DataFrame, scope: Shared, region: str, metric: str) -> pd.Series:
    """Method -> mean over the scenes that count for it; NaN if one of them has no value.

    Scenes in which the region is empty, so that no method has a value, do not count.
    """
    return over_scenes(per_scene(results, region, metric), scope)


def over_scenes(table: pd.DataFrame, scope: Shared) -> pd.Series:
    """`means` of a table that `per_scene` made."""
    table = table.reindex(index=list(scope.asked), columns=list(scope.methods))
    filled = table.notna().any(axis=1)
    chosen = {m: [s for s in scope.counted(m) if filled[s]] for m in scope.methods}
    return pd.Series({m: table.loc[chosen[m], m].mean(skipna=False) for m in scope.methods}, dtype=float)


def timed_alike(cells: pd.DataFrame) -> pd.Series:
    """A mask of the cells whose seconds can be compared.

    They were measured while no other cell ran, on one machine and with one number of threads. If there are
    several such groups, it is the largest.
    """
    alone = cells.get("alone", pd.Series(True, cells.index)).astype(str) != "False"
    good = (cells["status"] == "ok") & alone
    names = ("machine", "threads")
    where = pd.Series("", cells.index)
    for name in names:
        where += " " + cells.get(name, pd.Series("", cells.index)).astype(str)
    places = where[good].value_counts(sort=False)
    return good & (where == places.idxmax()) if len(places) else good


def timing_note(cells: pd.DataFrame) -> str:
    """A note if not all times can be compared; else empty."""
    ok = int((cells["status"] == "ok").sum())
    compared = int(timed_alike(cells).sum())
    if compared == ok:
        return ""
    return f"time: of {compared} of {ok} cells; the others ran on another machine or not alone"


def seconds(cells: pd.DataFrame, scope: Shared) -> pd.Series:
    """Method -> mean wall time per scene, over the same scenes as its scores; NaN unless all are `timed_alike`."""
    planned = labelled(cells)
    good = planned[timed_alike(planned)]
    table = good.assign(seconds=good["seconds"].astype(float)).groupby(["scene", "method"])["seconds"].mean()
    wide = table.unstack("method").reindex(index=list(scope.asked), columns=list(scope.methods))
    return pd.Series({m: wide.loc[list(scope.counted(m)), m].mean(skipna=False) for m in scope.methods}, dtype=float)


def memory(cells: pd.DataFrame, scope: Shared) -> pd.Series:
    """Method -> the largest peak memory, in MiB, over the scenes that count: what a machine must have."""
    planned = labelled(cells)
    good = planned[planned["status"] == "ok"]
    table = good.assign(peak=good["peak_mb"].astype(float)).groupby(["scene", "method"])["peak"].max().unstack("method")
    wide = table.reindex(index=list(scope.asked), columns=list(scope.methods))
    return pd.Series({m: wide.loc[list(scope.counted(m)), m].max(skipna=False) for m in scope.methods}, dtype=float)


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
    (pixels of the pair), ``seconds``, then ``scenes`` (how many the means are over), ``asked``
    (how many it was asked for) and ``ranked``. Ranked methods share their scenes; a method that
    lacks one of these has means over its own scenes and is not ranked.
    """
    scope = shared(results, cells)
    columns = {f"{metric} {region}": means(results, scope, region, metric) for region in summarised(results)}
    columns["avg all"] = means(results, scope, REGION, "avg")
    columns["seconds"] = seconds(cells, scope)
    out = pd.DataFrame(columns, index=pd.Index(scope.methods, name="method", dtype=str), dtype=float)
    out["scenes"] = [len(scope.counted(m)) for m in scope.methods]
    out["asked"] = len(scope.asked)
    out["ranked"] = pd.Series([scope.is_ranked(m) for m in scope.methods], out.index, dtype=bool)
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


def text(value: float, unit: str) -> str:
    """A number as every table shows it, without its unit.

    >>> text(2.345, "%"), text(0.01234, "s"), text(float("nan"), "px")
    ('2.35', '0.012', '–')
    """
    if pd.isna(value):
        return "–"
    if unit in ("%", "px"):
        return f"{value:.2f}"
    if unit == "s":
        return f"{value:.{0 if value >= 100 else 1 if value >= 10 else 2 if value >= 1 else 3}f}"
    return f"{value:.4g}"


def places(values: pd.Series, unit: str, better: Better = "lower") -> pd.Series:
    """1 for the best, 2 for the second best, else 0, by the numbers as shown: ties share a place.

    Nothing is marked where all are equal or only one has a value.
    """
    shown = [merit(float(text(v, unit)), better) if pd.notna(v) else float("nan") for v in values]
    if len({v for v in shown if v == v}) < 2:
        return pd.Series(0, values.index)
    ahead = [sum(other < v for other in shown) if v == v else len(shown) for v in shown]
    return pd.Series([a + 1 if a < 2 else 0 for a in ahead], values.index)
