"""What has changed since an earlier run: the same methods on the same scenes, cell by cell."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from attrs import frozen

from matbench.errors import UserError
from matbench.measures.metrics import Better
from matbench.measures.statistics import Effect, paired_effects
from matbench.plans.plan import Method, Plan
from matbench.results import freshness
from matbench.results.comparable import SILENT, counted, is_enough
from matbench.runs.store import Store
from matbench.scene import Scene
from matbench.shelf import facts_of
from matbench.spec import witness

Names = tuple[str, str]
"""A method as tables call it: its columns ``algorithm`` and ``params``."""

COLUMNS = (
    "algorithm",
    "params",
    "scene",
    "seed",
    "region",
    "metric",
    "unit",
    "before",
    "now",
    "change",
    "answered",
    "counted",
)
EFFECT_COLUMNS = ("algorithm", "params", "region", "metric", "unit", "change", "low", "high", "scenes", "verdict")
UNCHANGED = "unchanged"
"""The verdict where no scene's score has changed at all: that takes no statistics."""

_WHERE = ["scene", "seed", "region", "metric"]


def paired(now: Plan, before: Plan) -> dict[Names, Names]:
    """The methods of a plan -> the same ones of an earlier plan, whatever their code; those that are in both.

    It is the one of the same name. If there is none, as where one has a label, it is one of the same algorithm and
    parameters.
    """
    old = {str(cell.method): cell.method for cell in before.cells}
    by_params = {_asked(method): method for method in reversed(old.values())}
    found = {}
    for method in {str(cell.method): cell.method for cell in now.cells}.values():
        same = old.get(str(method)) or by_params.get(_asked(method))
        if same is not None:
            found[method.names] = same.names
    return found


def _asked(method: Method) -> tuple[str, str]:
    return method.algorithm, json.dumps(dict(method.params), sort_keys=True)


@frozen
class Shared:
    """What an earlier run shares with a run.

    Parameters
    ----------
    methods
        As `paired` finds them.
    scenes
        Those that are the same in both.
    others
        Scenes of the later run that the earlier one has not, or as others.
    """

    methods: Mapping[Names, Names]
    scenes: Sequence[str]
    others: Sequence[str]


def shared(now: Plan, folder: Path, scenes: Mapping[str, Scene], run: Path) -> Shared:
    """What an earlier run shares with the plan, folder and scenes of a run.

    Raises
    ------
    UserError
        If it is no run, its tables are stale, or it shares no method or no scene with that one.
    """
    if run.resolve() == folder.resolve():
        raise UserError(f"{str(run)!r} is this run itself: name another folder by --out, or an earlier run")
    earlier = Store(run)
    earlier.check_place()
    plan = earlier.plan()
    if why := freshness.fault(plan, earlier):
        raise UserError(f"{freshness.stale(run, why)} first")
    pairs, made = paired(now, plan), freshness.made(earlier)
    if not pairs:
        has = ", ".join(dict.fromkeys(str(cell.method) for cell in plan.cells))
        raise UserError(f"{str(run)!r} has none of these methods: it has {has}")
    known = {cell.scene: (cell.scene_digest, made.truth.get(cell.scene) if made else None) for cell in plan.cells}
    is_same = {name: known.get(name) == (s.digest, s.truth_digest) for name, s in facts_of(scenes).items()}
    other = [name for name in is_same if not is_same[name]]
    if len(other) == len(is_same):
        raise UserError(f"{str(run)!r} has none of these scenes as they are: {', '.join(other)}")
    return Shared(pairs, [name for name in is_same if is_same[name]], other)


def changes(now: pd.DataFrame, before: pd.DataFrame, pairs: Mapping[Names, Names]) -> pd.DataFrame:
    """Every score that both runs have.

    Parameters
    ----------
    now, before
        Their ``results.csv``.
    pairs
        As `paired` found them.

    Returns
    -------
    Columns `COLUMNS`. `change` is now minus before, in `unit`. `answered` is the per cent of the pixels that the score
    is over, in the run that answers less. `counted`: does the score enter means over scenes?
    """
    now = now.assign(counted=counted(now))
    parts = []
    for new, old in pairs.items():
        mine, theirs = (_of(table, names) for table, names in ((now, new), (before, old)))
        both = mine.merge(theirs[[*_WHERE, "value", "answered"]], on=_WHERE, suffixes=("", "_before"))
        parts.append(
            both.assign(
                before=both["value_before"],
                now=both["value"],
                change=both["value"] - both["value_before"],
                answered=both[["answered", "answered_before"]].min(axis=1),
            )
        )
    whole = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(COLUMNS))
    return whole[list(COLUMNS)]


def _of(table: pd.DataFrame, names: Names) -> pd.DataFrame:
    params = table["params"].fillna("").astype(str)
    return table[(table["algorithm"] == names[0]) & (params == names[1])]


def effects(table: pd.DataFrame, better: Mapping[str, Better]) -> pd.DataFrame:
    """The mean change of each method, region and metric over scenes, and whether it is more than chance.

    A scene with several options or seeds counts once, with the mean of its changes. Of a signed metric, whose best is
    zero, the change is that of its magnitude.

    Parameters
    ----------
    table
        As `changes` makes it.
    better
        Metric -> which direction of it is better.

    Returns
    -------
    Columns `EFFECT_COLUMNS`. `change` is a mean in `unit`, `low` and `high` are its interval, `verdict` is as in
    `matbench.measures.statistics.Effect`, `SILENT` where too little is answered, or `UNCHANGED`.
    """
    rows = table[table["counted"].astype(bool)]
    signed = rows["metric"].map(lambda name: better.get(str(name)) == "zero")
    change = rows["change"].where(~signed, rows["now"].abs() - rows["before"].abs())
    rows = rows.assign(change=change, shown=rows["scene"].map(lambda scene: witness(str(scene))))
    heads = ["algorithm", "params", "region", "metric", "unit"]
    groups = rows.assign(unit=rows["unit"].fillna("")).groupby([*heads, "shown"], sort=False, dropna=False)
    # a mean skips missing numbers; but a scene that lacks one of its repeats must have no mean
    means = groups["change"].mean().where(groups["change"].count() == groups.size())
    answered = groups["answered"].mean()
    found = [(names, part.to_list()) for names, part in means.groupby(heads, sort=False)]
    least = [float(share) for share in answered.groupby(heads, sort=False).mean()]
    judged: Sequence[Effect] = paired_effects([values for _, values in found])
    return pd.DataFrame(
        [
            (*names, e.mean, e.low, e.high, e.scenes, _verdict(values, e, share))
            for (names, values), e, share in zip(found, judged, least, strict=True)
        ],
        columns=list(EFFECT_COLUMNS),
    )


def _verdict(changes: Sequence[float], effect: Effect, answered: float) -> str:
    if changes and not any(changes):  # NaN is no zero
        return UNCHANGED
    return effect.verdict if is_enough(answered) else SILENT
