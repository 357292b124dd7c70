"""Curves of the error over a number that varies within one run: an option of scenes, or a parameter of a method.

Within a sweep all else is equal. Its means are over the scenes in which every curve has every value.
Otherwise one point of a curve might be a mean over easier scenes than the next.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from math import isfinite, nan

import numpy as np
import pandas as pd
from attrs import frozen

from matbench import spec
from matbench.measures.statistics import FEW, intervals, paired_effects, together
from matbench.plans.plan import Method, Plan
from matbench.results.comparable import SILENT, counted, is_enough
from matbench.spec import Spec

LEAST_VALUES = 3
"""A curve has at least so many values. Two values are a switch (`matbench.results.ablation`)."""

REPEATS = ("ref", "seed")
"""Options whose numbers are only names. They give no curves; results are averaged over them within a scene."""

COLUMNS = (
    "algorithm",
    "params",
    "value",
    "region",
    "metric",
    "unit",
    "mean",
    "low",
    "high",
    "change",
    "change_low",
    "change_high",
    "scenes",
    "verdict",
    "enough",
    "answered",
)


@frozen(eq=False)
class Sweep:
    """The curves over the values of one option.

    Parameters
    ----------
    option
        Its name.
    of
        The algorithm whose parameter it is; empty for an option of scenes.
    setting
        The values of all other scene options that vary in the run, as they are typed.
    values
        At least `LEAST_VALUES`, increasing.
    scenes
        The scenes that the means are over.
    left_out
        Scenes that have these values but lack a result.
    moving
        Regions whose number of pixels changes with the value.
    limits
        Method -> its own parameter of the same name, where it is below the largest value. An example is a
        method that uses at most 3 views, on scenes with ``views=2,3,5``.
    curves
        Columns `COLUMNS`. `params` are the parameters that differ from their defaults, without the option
        itself. `mean` is over the scenes; `low` and `high` are its interval, NaN below `FEW` scenes. `change` is
        the paired difference from the first value, with its interval, verdict and `enough` as in
        `matbench.measures.statistics.Effect`; all changes of one metric in one region are judged beside each other
        (`matbench.measures.statistics.together`). `answered` is the per cent of the pixels that the mean is over. If it
        is less than `matbench.measures.metrics.ENOUGH` at one of the two values, the verdict is `SILENT`. Only scenes
        on which a region counts at every value are used for it (`matbench.results.comparable.counted`).
    """

    option: str
    of: str
    setting: str
    values: tuple[float, ...]
    scenes: tuple[str, ...]
    left_out: tuple[str, ...]
    moving: tuple[str, ...]
    limits: Mapping[str, float]
    curves: pd.DataFrame


def is_swept(scenes: Iterable[Spec]) -> bool:
    """Does an option of some scene or pattern take enough numbers for a curve?"""
    values: dict[tuple[str, str], set[float]] = {}
    for scene in scenes:
        for option, text in scene.options.items():
            if option not in REPEATS and isfinite(number := _number(text)):
                values.setdefault((scene.name, option), set()).add(number)
    return any(len(found) >= LEAST_VALUES for found in values.values())


def table(sweeps: Sequence[Sweep]) -> pd.DataFrame:
    """All curves in one table, ``sweeps.csv``: the facts of each `Sweep`, then the columns of its curves."""
    parts = [
        sweep.curves.assign(
            option=sweep.option,
            of=sweep.of,
            setting=sweep.setting,
            values=" ".join(f"{v:g}" for v in sweep.values),
            over="; ".join(sweep.scenes),
        )
        for sweep in sweeps
    ]
    heads = ["option", "of", "setting", "values"]
    whole = pd.concat(parts) if parts else pd.DataFrame(columns=[*heads, *COLUMNS, "over"])
    return whole[[*heads, *COLUMNS, "over"]]


def sweeps(plan: Plan, results: pd.DataFrame) -> list[Sweep]:
    """All sweeps of a run.

    Scenes that have different values share a sweep over their common values. For example, one scene has
    2, 3 and 5 views, another has 2, 3, 5 and 7. Then there is a sweep of three values over both scenes,
    and a sweep of four values over the second scene.

    Parameters
    ----------
    results
        ``results.csv`` of the plan.
    """
    cells = _cells(plan)
    found = []
    for option in dict.fromkeys(chain.from_iterable(cells["options"])):
        if option not in REPEATS:
            values = [_number(options.get(option)) for options in cells["options"]]
            found += _sweeps_of(option, "", cells.assign(value=values, curve=cells["method"].map(str)), results)
    for algorithm, mine in cells.groupby("algorithm", sort=False):
        for option in mine["method"].iloc[0].params:
            if option not in REPEATS:
                values = [_number(method.params[option]) for method in mine["method"]]
                curve = [spec.text({k: v for k, v in m.params.items() if k != option}) for m in mine["method"]]
                found += _sweeps_of(option, str(algorithm), mine.assign(value=values, curve=curve), results)
    return found


def _number(value: object) -> float:
    """An option's text or a parameter's value as a number; NaN if it is none."""
    return float(str(value)) if re.fullmatch(r"-?[0-9]{1,9}(\.[0-9]+)?(e-?[0-9]{1,2})?", str(value)) else nan


def _cells(plan: Plan) -> pd.DataFrame:
    """One row for each cell and each name by which its scene was asked for: two values may mean one scene."""
    spelled: dict[str, list[str]] = {cell.scene: [cell.scene] for cell in plan.cells}
    for name, kept in plan.spellings.items():
        spelled[kept].append(name)
    rows = [
        (c.method, *c.method.names, c.scene, c.seed, one.name, one.options)
        for c in plan.scored
        for one in map(spec.read_scene, spelled[c.scene])
    ]
    columns = ["method", "algorithm", "params", "scene", "seed", "base", "options"]
    return pd.DataFrame(rows, columns=columns).astype({"scene": object, "params": object, "base": object})


def _varying(cells: pd.DataFrame) -> set[str]:
    """The options that differ between two requests for the same scene."""
    found: set[str] = set()
    for _, options in cells.groupby("base")["options"]:
        names = set(chain.from_iterable(options))
        found |= {name for name in names if len({one.get(name) for one in options}) > 1}
    return found


def _sweeps_of(option: str, of: str, cells: pd.DataFrame, results: pd.DataFrame) -> list[Sweep]:
    """The sweeps of one option: `cells` have its `value` and the `curve` that they are on."""
    if cells["value"].nunique() < LEAST_VALUES:  # most options take one value only
        return []
    varying = _varying(cells) - set(REPEATS)
    rest = [{k: v for k, v in options.items() if of or k != option} for options in cells["options"]]
    setting = [spec.text({k: v for k, v in one.items() if k in varying}) for one in rest]
    fixed = [{k: v for k, v in one.items() if k not in varying and k not in REPEATS} for one in rest]
    cells = cells.assign(
        setting=setting,
        base=[spec.label(base, one) for base, one in zip(cells["base"], fixed, strict=True)],
        repeat=[
            f"{spec.text({k: v for k, v in one.items() if k in REPEATS})} {seed}"
            for one, seed in zip(rest, cells["seed"], strict=True)
        ],
    ).dropna(subset="value")
    out = []
    for name, part in cells.groupby("setting", sort=False):
        asked = part.groupby(["curve", "base", "repeat"])["value"].agg(frozenset)
        # every set of values that some point has makes a sweep; points that have more values take part in it, too
        for values in sorted({v for v in asked if len(v) >= LEAST_VALUES}, key=lambda v: (-len(v), sorted(v))):
            # a point is one curve on one scene in one repeat
            points = asked.index[[values <= v for v in asked]]
            keys = pd.MultiIndex.from_frame(part[["curve", "base", "repeat"]])
            chosen = part[keys.isin(points) & part["value"].isin(values)]
            out.append(_sweep(option, of, str(name), tuple(sorted(values)), chosen, results))
    return out


def _sweep(
    option: str, of: str, setting: str, values: tuple[float, ...], cells: pd.DataFrame, results: pd.DataFrame
) -> Sweep:
    kept = results["value"].where(counted(results))
    answered = results.get("answered", pd.Series(nan, results.index))
    scored = results.assign(params=results["params"].fillna(""), score=kept, answered=answered)
    scored = scored.drop(columns="value")
    joined = cells.merge(scored, on=["algorithm", "params", "scene", "seed"], how="left")
    # after the left join, a cell without results has no metric: one such cell leaves its scene out
    done = joined["metric"].notna().groupby(joined["base"], sort=False).all()
    good = joined[joined["base"].map(done)]
    methods = {str(row["curve"]): row["method"] for row in cells.drop_duplicates("curve").to_dict("records")}
    return Sweep(
        option,
        of,
        setting,
        values,
        tuple(str(scene) for scene in done.index[done]),
        tuple(str(scene) for scene in done.index[~done]),
        _moving(good),
        {} if of else _limits(methods.values(), option, values[-1]),
        _curves(good, {curve: (m.names[0], _without(m, option if of else "")) for curve, m in methods.items()}),
    )


def _moving(good: pd.DataFrame) -> tuple[str, ...]:
    """The regions that do not hold as many pixels at every value."""
    counts = good.groupby(["region", "metric", "base", "repeat"], sort=False)["pixels"].nunique()
    return tuple(dict.fromkeys(str(region) for region, *_ in counts.index[counts > 1]))


def _limits(methods: Iterable[Method], option: str, largest: float) -> dict[str, float]:
    """Method -> its own parameter of that name, if it is below the largest value; 0 means no limit."""
    own = {str(method): _number(method.params.get(option)) for method in methods}
    return {name: limit for name, limit in own.items() if 0 < limit < largest}


def _without(method: Method, option: str) -> str:
    """A method's label without one of its parameters."""
    return " ".join(part for part in method.names[1].split() if part.partition("=")[0] != option)


def _curves(good: pd.DataFrame, labels: Mapping[str, tuple[str, str]]) -> pd.DataFrame:
    """The means of every curve and value over the scenes that have all of them."""
    heads = ["region", "metric", "unit"]
    groups = good.groupby([*heads, "curve", "value", "base"], sort=False)
    # a mean skips missing numbers; but a scene that lacks one of its repeats must have no mean
    scores = groups["score"].mean().where(groups["score"].count() == groups.size())
    per_scene = scores.unstack("base").sort_index(level="value")
    # a curve without any score, as of a method that never answers, takes no scene from the others
    per_scene = per_scene[per_scene.notna().any(axis=1).groupby([*heads, "curve"]).transform("all")]
    shares = groups["answered"].mean().unstack("base")
    has = per_scene.notna().groupby(heads).transform("all")
    rows: list[tuple[object, ...]] = []
    # there are few different sets of scenes, and all rows of one set are computed at once: that is much faster
    for known in set(map(tuple, has.to_numpy().tolist())):
        part = per_scene.loc[(has == list(known)).all(axis=1), list(known)]
        if part.shape[1]:  # else the region is empty
            over = shares.loc[part.index, part.columns].mean(axis=1)
            for (*head, curve, value), line in zip(part.index, _lines(part, over), strict=True):
                rows.append((*labels[str(curve)], value, *head, *line))
    found = pd.DataFrame(rows, columns=list(COLUMNS)).astype({"enough": float})
    # rows in the order in which the run has its methods, regions and metrics, not in that of the alphabet
    places = {"algorithm": [a for a, _ in labels.values()], "params": [p for _, p in labels.values()]}
    places |= {name: list(good[name].unique()) for name in ("region", "metric")}
    order = [found[name].map(list(dict.fromkeys(places[name])).index) for name in places]
    return found.iloc[np.lexsort([found["value"], *order[::-1]])].reset_index(drop=True)


def _lines(scores: pd.DataFrame, answered: pd.Series) -> list[tuple[object, ...]]:
    """The values of `COLUMNS` from `mean` on, for each row of `scores`.

    Parameters
    ----------
    scores
        One row for each curve and value, values increasing; one column for each scene.
    answered
        Per cent of the pixels that the scores of each row are over.
    """
    numbers, count = scores.to_numpy(np.float64), scores.shape[1]
    curves = scores.groupby(["region", "metric", "unit", "curve"], sort=False)
    first = scores.index.get_level_values("value") == scores.index.get_level_values("value").min()
    effects = paired_effects(list(numbers - curves.transform("first").to_numpy(np.float64)))
    # the first value differs from itself by nothing: no difference to be judged
    families = [None if is_first else tuple(key[:3]) for is_first, key in zip(first, scores.index, strict=True)]
    effects = together(effects, families)
    means, nothing = numbers.mean(axis=1), np.full((2, len(scores)), nan)
    low, high = intervals(numbers) if count >= FEW else nothing
    least, most = zip(*((e.low, e.high) for e in effects), strict=True) if count >= FEW else nothing
    shifts = [effect.mean for effect in effects]
    lowest = np.fmin(answered, answered.groupby(["region", "metric", "unit", "curve"], sort=False).transform("first"))
    verdicts = [
        "" if is_first else effect.verdict if is_enough(share) else SILENT
        for is_first, effect, share in zip(first, effects, lowest, strict=True)
    ]
    count_each, enough = [count] * len(scores), [effect.enough for effect in effects]
    return list(zip(means, low, high, shifts, least, most, count_each, verdicts, enough, answered, strict=True))
