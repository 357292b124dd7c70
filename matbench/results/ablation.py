"""What each switch of a method does: paired differences, factor by factor."""

from collections.abc import Mapping, Sequence

import pandas as pd
from attrs import asdict

from matbench.errors import UserError
from matbench.measures.statistics import paired_effect
from matbench.plans.plan import Method, Plan
from matbench.results.sweeps import is_swept
from matbench.spec import Value, expand, read_scene, text

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
    "verdict",
)


def factors(methods: Sequence[Method]) -> dict[str, dict[str, list[Value]]]:
    """Algorithm -> parameter -> its values, for each parameter that varies; the first value is the base."""
    found: dict[str, dict[str, list[Value]]] = {}
    for method in methods:
        levels = found.setdefault(method.algorithm, {})
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

    All else is equal within a difference: the other parameters, scene, seed, region. Differences
    are averaged within a scene, over its options, seeds and the other factors' levels; effects are
    over scenes.

    Parameters
    ----------
    results
        ``results.csv`` of the plan.

    Returns
    -------
    Columns `COLUMNS`: `change` is the mean of level minus base in `unit`, `low` and `high` its
    interval, and so on as in `matbench.measures.statistics.Effect`.
    """
    methods = list({str(cell.method): cell.method for cell in plan.cells}.values())
    by_label = {(method.algorithm, method.changed): method for method in methods}
    rows = []
    for algorithm, levels in factors(methods).items():
        mine = results[results["algorithm"] == algorithm]
        for factor, values in levels.items():
            wide = _levels_side_by_side(mine, by_label, factor)
            for level in values[1:]:
                base, other = text({factor: values[0]}), text({factor: level})
                if base not in wide or other not in wide:
                    continue
                change = (wide[other] - wide[base]).groupby(["region", "metric", "unit", "shown"], sort=False).mean()
                for (region, metric, unit), over_scenes in change.groupby(["region", "metric", "unit"], sort=False):
                    effect = paired_effect(over_scenes.to_list())
                    numbers = asdict(effect)
                    head = (algorithm, factor, base.partition("=")[2], other.partition("=")[2], region, metric, unit)
                    rows.append((*head, *numbers.values(), effect.verdict))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _levels_side_by_side(results: pd.DataFrame, methods: Mapping[tuple[str, str], Method], factor: str) -> pd.DataFrame:
    """One column for each level of the factor; the index names all that is equal within a row."""
    labels = list(zip(results["algorithm"], results["params"], strict=True))
    level = [text({factor: methods[label].params[factor]}) for label in labels]
    rest = [text({k: v for k, v in methods[label].params.items() if k != factor}) for label in labels]
    shown = results["scene"].map(lambda scene: read_scene(str(scene)).name)  # noisy or in half size, it is one scene
    keys = ["rest", "shown", "scene", "seed", "region", "metric", "unit"]
    return results.assign(level=level, rest=rest, shown=shown).set_index([*keys, "level"])["value"].unstack("level")
