"""What each switch of a method does: paired differences, factor by factor."""

from collections.abc import Mapping, Sequence

import pandas as pd

from matbench.errors import UserError
from matbench.measures.statistics import paired_effects, together
from matbench.plans.plan import Method, Plan
from matbench.results.comparable import SILENT, counted, is_enough
from matbench.results.sweeps import is_swept
from matbench.spec import expand, text, witness
from matbench.typed import Value

COLUMNS = (
    "algorithm",
    "factor",
    "base",
    "level",
    "region",
    "metric",
    "unit",
    "change",
    "low",
    "high",
    "effect_size",
    "scenes",
    "p",
    "verdict",
    "enough",
    "answered",
)


def factors(methods: Sequence[Method]) -> dict[str, dict[str, list[Value]]]:
    """Algorithm -> parameter -> its values, for each parameter that varies; the first value is the base."""
    found: dict[str, dict[str, list[Value]]] = {}
    for method in methods:
        levels = found.setdefault(method.names[0], {})
        for name, value in method.params.items():
            known = levels.setdefault(name, [])
            if value not in known:
                known.append(value)
    return {
        algorithm: {name: values for name, values in levels.items() if len(values) > 1}
        for algorithm, levels in found.items()
    }


def check_varies(methods: Sequence[Method], scenes: Sequence[str]) -> None:
    """Refuse a request in which nothing varies.

    Parameters
    ----------
    scenes
        Selectors.

    Raises
    ------
    UserError
        If no parameter of any method takes two values, and no option of a scene enough for a curve.
    """
    if not any(factors(methods).values()) and not is_swept(expand(scenes)):
        raise UserError(
            "nothing varies: give a parameter several values, as in 'materiality[pairs=all,consecutive]', "
            "or an option of a scene three numbers or more, as in -s 'synthetic/box[noise=0,4,8]'"
        )


def ablation(plan: Plan, results: pd.DataFrame) -> pd.DataFrame:
    """The change of every metric and region when one factor goes from its base to another level.

    Within a difference all else is equal: the other parameters, scene, seed and region. Differences are first
    averaged within a scene: over its options, the seeds and the levels of the other factors. Effects are then
    over the scenes in which the region counts (`matbench.results.comparable.counted`) and no value is missing.

    Parameters
    ----------
    results
        ``results.csv`` of the plan.

    Returns
    -------
    Columns `COLUMNS`. `change` is the mean of level minus base in `unit`; `low` and `high` are its interval; the
    rest is as in `matbench.measures.statistics.Effect`. All changes of one metric in one region are judged beside each
    other (`matbench.measures.statistics.together`). `answered` is the per cent of the pixels that the value is over,
    for the level that answers less. Below `matbench.measures.metrics.ENOUGH` the verdict is `SILENT`.
    """
    methods = list({str(cell.method): cell.method for cell in plan.cells}.values())
    by_label = {method.names: method for method in methods}
    results = results[counted(results)]
    if "answered" not in results:  # tables of earlier versions
        results = results.assign(answered=float("nan"))
    heads: list[tuple[object, ...]] = []
    answered: list[float] = []
    changes: list[list[float]] = []
    for algorithm, levels in factors(methods).items():
        mine = results[results["algorithm"] == algorithm]
        if mine.empty:  # as where a run was interrupted early
            continue
        for factor, values in levels.items():
            wide = _levels_side_by_side(mine, by_label, factor)
            for level in values[1:]:
                base, other = text({factor: values[0]}), text({factor: level})
                # a level whose cells all failed has no column
                if base not in wide["value"] or other not in wide["value"]:
                    continue
                change = _by_scene(wide["value"][other] - wide["value"][base])
                both = wide["answered"][[base, other]].to_numpy(float)
                shares = pd.DataFrame(both, wide.index).groupby(list(_HEADS), sort=False).mean().min(axis=1).to_dict()
                for names, over_scenes in change.groupby(list(_HEADS), sort=False):
                    heads.append((algorithm, factor, base.partition("=")[2], other.partition("=")[2], *names))
                    changes.append(over_scenes.to_list())
                    answered.append(float(shares[names]))
    effects = together(paired_effects(changes), [tuple(head[4:]) for head in heads])
    rows = [
        (
            *head,
            e.mean,
            e.low,
            e.high,
            e.size,
            e.scenes,
            e.p,
            e.verdict if is_enough(share) else SILENT,
            e.enough,
            share,
        )
        for head, e, share in zip(heads, effects, answered, strict=True)
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS)).astype({"enough": float})


_HEADS = ("region", "metric", "unit")


def _by_scene(changes: pd.Series) -> pd.Series:
    """The mean change of each scene, over its options, the seeds and the levels of the other factors.

    A combination of levels counts only if it has a value for every option and seed: otherwise a failure on a hard
    variant of the scene would make the mean look better. Combinations that do not count are left out.
    """
    groups = changes.groupby([*_HEADS, "shown", "rest"], sort=False)
    whole = groups.mean().where(groups.count() == groups.size())
    return whole.groupby([*_HEADS, "shown"], sort=False).mean()


def _levels_side_by_side(results: pd.DataFrame, methods: Mapping[tuple[str, str], Method], factor: str) -> pd.DataFrame:
    """`value` and `answered`, each with one column for every level of the factor; the index holds what is equal."""
    labels = list(zip(results["algorithm"], results["params"], strict=True))
    level = [text({factor: methods[label].params[factor]}) for label in labels]
    rest = [text({k: v for k, v in methods[label].params.items() if k != factor}) for label in labels]
    # with noise or in half size it is still the same scene, and no second witness
    shown = results["scene"].astype(str).map(witness)
    keys = ["rest", "shown", "scene", "seed", "region", "metric", "unit"]
    known = results.assign(level=level, rest=rest, shown=shown)
    return known.pivot(index=keys, columns="level", values=["value", "answered"])
