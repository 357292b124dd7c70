"""Which method is ahead, and whether that is more than chance: mean ranks and paired differences over scenes."""

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from attrs import frozen

from matbench.measures.metrics import Better
from matbench.measures.statistics import Effect, paired_effects
from matbench.reports.tables import Shared, merit, text
from matbench.spec import read_scene

REFERENCES = 12
"""How many methods, the best by the summary, others are compared with: all pairs would be too many."""


def witnesses(table: pd.DataFrame, scope: Shared) -> pd.DataFrame:
    """The shared scenes x the ranked methods: means, ranks and differences are taken over these.

    Parameters
    ----------
    table
        Scenes x methods, as `matbench.reports.tables.per_scene` makes it.

    Returns
    -------
    One row for each distinct scene. A scene with several options counts once: its values are averaged, as they
    are not independent. Scenes in which the region is empty, so that no method has a value, are left out.
    """
    ranked = [m for m in scope.methods if scope.is_ranked(m)]
    chosen = table.reindex(index=list(scope.scenes), columns=ranked).dropna(how="all")
    names = [read_scene(str(scene)).name for scene in chosen.index]
    if len(set(names)) == len(names):
        return chosen
    groups = chosen.groupby(names, sort=False)
    return groups.mean().where(groups.count().eq(groups.size(), axis=0))


def mean_ranks(
    table: pd.DataFrame, scope: Shared, unit: str, better: Better, aside: Collection[str] = ()
) -> dict[str, float]:
    """Method -> its rank (1 is best), averaged over `witnesses`; NaN if it is not ranked or lacks a value.

    NaN for a method that is not ranked, is one of `aside`, or lacks a value.
    """
    rows = witnesses(table, scope).drop(columns=list(aside), errors="ignore")
    shown = rows.map(lambda value: float(text(value, unit)) if pd.notna(value) else np.nan)
    means = merit(shown, better).rank(axis=1).mean(skipna=False)
    return {m: float(means.get(m, np.nan)) for m in scope.methods}


@frozen
class Difference:
    """The difference between two methods, as the `matbench.measures.statistics.Effect` of their paired differences."""

    method: str
    reference: str
    effect: Effect


def references(scope: Shared) -> list[str]:
    """The methods that others can be compared with: the first `REFERENCES` ranked ones."""
    return [m for m in scope.methods if scope.is_ranked(m)][:REFERENCES]


def differences(tables: Sequence[pd.DataFrame], scope: Shared) -> list[list[Difference]]:
    """For each table, the difference of every ranked method minus every reference that ranks before it.

    Parameters
    ----------
    tables
        Scenes x methods of one metric in one region each.
    """
    known = references(scope)
    ranked = [m for m in scope.methods if scope.is_ranked(m)]
    pairs = [(b, a) for a, b in combinations(ranked, 2) if a in known]
    rows = [witnesses(table, scope) for table in tables]
    values = [(part[b] - part[a]).to_numpy(float) if len(part) else np.empty(0) for part in rows for b, a in pairs]
    effects = iter(paired_effects(values))
    return [[Difference(b, a, next(effects)) for b, a in pairs] for _ in tables]
