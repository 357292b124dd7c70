"""Which method is ahead, and whether that is more than chance: mean ranks and paired differences over scenes."""

from collections.abc import Collection, Mapping, Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from attrs import evolve, frozen

from matbench.measures.metrics import Better
from matbench.measures.statistics import CONFIDENCE, FEW, Effect, paired_effects, together
from matbench.reports.tables import REGION, Shared, like, means, merit, per_scene, shared, summary, text, too_silent
from matbench.spec import witness

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
    chosen = like(table, scope.scenes, ranked).dropna(how="all")
    names = [witness(str(scene)) for scene in chosen.index]
    if len(set(names)) == len(names):
        return chosen
    groups = chosen.groupby(names, sort=False)
    return groups.mean().where(groups.count().eq(groups.size(), axis=0))


def _ranks(table: pd.DataFrame, scope: Shared, unit: str, better: Better, aside: Collection[str]) -> pd.DataFrame:
    """The ranks of methods on every witness, by the scores as shown: 1 is best, ties share a mean rank."""
    rows = witnesses(table, scope).drop(columns=list(aside), errors="ignore")
    scores, places = np.unique(rows.to_numpy(float), return_inverse=True)
    values = np.array([float(text(v, unit)) if v == v else np.nan for v in scores.tolist()], float)
    shown = pd.DataFrame(values[places].reshape(rows.shape), rows.index, rows.columns, dtype=float)
    return merit(shown, better).rank(axis=1)


def mean_ranks(
    table: pd.DataFrame, scope: Shared, unit: str, better: Better, aside: Collection[str] = ()
) -> dict[str, float]:
    """Method -> its rank (1 is best), averaged over `witnesses`.

    NaN for a method that is not ranked, is one of `aside`, or lacks a value.
    """
    means = _ranks(table, scope, unit, better, aside).mean(skipna=False)
    return {m: float(means.get(m, np.nan)) for m in scope.methods}


@frozen
class Ranking:
    """Mean ranks, and how far apart two must be to differ by more than chance.

    Parameters
    ----------
    means
        Method -> its rank, averaged over the scenes; best first.
    scenes
        How many scenes it is over.
    critical
        Nemenyi's critical difference between two mean ranks.
    p
        Friedman's probability of ranks so different or more, if all methods were equal.
    """

    means: Mapping[str, float]
    scenes: int
    critical: float
    p: float

    @property
    def alike(self) -> list[tuple[str, ...]]:
        """The largest groups of methods whose mean ranks are all within the critical difference; best first."""
        names = list(self.means)
        ends = [
            max(j for j in range(i, len(names)) if self.means[names[j]] - self.means[names[i]] < self.critical)
            for i in range(len(names))
        ]
        groups = [(i, end) for i, end in enumerate(ends) if end > i and (i == 0 or end > ends[i - 1])]
        return [tuple(names[i : end + 1]) for i, end in groups]


def ranking(
    table: pd.DataFrame, scope: Shared, unit: str, better: Better, aside: Collection[str] = ()
) -> Ranking | None:
    """The mean ranks of all ranked methods with their critical difference.

    For k methods on n scenes it is q sqrt(k (k + 1) / (6 n)), where q is the quantile of the studentised range of k,
    over sqrt(2) (Nemenyi 1963; Demsar 2006, Journal of Machine Learning Research 7). None for fewer than three methods,
    or fewer than `matbench.measures.statistics.FEW` scenes.
    """
    from scipy.stats import friedmanchisquare, studentized_range

    ranks = _ranks(table, scope, unit, better, aside).dropna(axis="columns")
    scenes, count = ranks.shape
    if count < 3 or scenes < FEW:
        return None
    means = ranks.mean().sort_values(kind="stable")
    q = float(studentized_range.ppf(CONFIDENCE, count, np.inf)) / np.sqrt(2)
    p = 1.0 if ranks.nunique(axis=1).max() == 1 else float(friedmanchisquare(*ranks.to_numpy().T).pvalue)
    return Ranking(
        {str(m): float(v) for m, v in means.items()}, scenes, q * np.sqrt(count * (count + 1) / (6 * scenes)), p
    )


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

    Those of one table are judged beside each other (`matbench.measures.statistics.together`).

    Parameters
    ----------
    tables
        Scenes x methods of one metric in one region each.
    """
    known = references(scope)
    ranked = [m for m in scope.methods if scope.is_ranked(m)]
    pairs = [(b, a) for a, b in combinations(ranked, 2) if a in known]
    place = {m: number for number, m in enumerate(ranked)}  # the columns of `witnesses`
    rows = [witnesses(table, scope).to_numpy(float) for table in tables]  # pandas takes a millisecond for each pair
    values = [part[:, place[b]] - part[:, place[a]] for part in rows for b, a in pairs]
    effects = iter(together(paired_effects(values), [i for i in range(len(tables)) for _ in pairs]))
    return [[Difference(b, a, next(effects)) for b, a in pairs] for _ in tables]


def against(found: Sequence[Difference], reference: str, scope: Shared) -> dict[str, Effect]:
    """Method -> the difference from `reference`, in the order of the methods; `found` as one of `differences`."""
    effects = {d.method: d.effect for d in found if d.reference == reference}
    effects |= {d.reference: turned(d.effect) for d in found if d.method == reference}
    return {m: effects[m] for m in scope.methods if m in effects}


def turned(effect: Effect) -> Effect:
    """The effect of the opposite difference: b - a for a - b."""
    return evolve(effect, mean=-effect.mean, low=-effect.high, high=-effect.low, size=-effect.size)


def paired(
    results: pd.DataFrame, first: str, second: str, metric: str, better: Better, region: str = REGION
) -> list[float]:
    """The differences of two methods, first minus second, one for each witness that both have a score on."""
    table = per_scene(results, region, metric).reindex(columns=[first, second])
    rows = (table.abs() if better == "zero" else table).dropna()
    means = rows.groupby([witness(str(scene)) for scene in rows.index], sort=False).mean()
    found: list[float] = (means[first] - means[second]).to_list()
    return found


@frozen
class Lead:
    """The best ranked method, and the differences of the others from it.

    Parameters
    ----------
    best
        Its name; empty if no method is ranked.
    behind
        Method -> its difference from the best, best first.
    compared
        How many methods the verdicts are corrected for.
    """

    best: str
    behind: Mapping[str, Effect]
    compared: int


def lead(
    results: pd.DataFrame,
    cells: pd.DataFrame,
    metric: str,
    better: Better,
    region: str = REGION,
    rows: pd.DataFrame | None = None,
) -> Lead:
    """Find the best ranked method of a run, and how far it is ahead; `rows` as `summary` gives them, if at hand."""
    rows = summary(results, cells, metric, better) if rows is None else rows
    scope = evolve(shared(results, cells), methods=tuple(str(m) for m in rows.index))
    silent = too_silent(means(results, scope, region, metric, "answered"))
    ranked = [m for m in references(scope) if m not in silent]
    if not ranked:
        return Lead("", {}, 0)
    table = per_scene(results, region, metric)
    (found,) = differences([table.abs() if better == "zero" else table], scope)
    behind = {m: e for m, e in against(found, ranked[0], scope).items() if m not in silent}
    return Lead(ranked[0], behind, sum(map(scope.is_ranked, scope.methods)))


def correction(compared: int) -> str:
    """What verdicts on the differences between so many methods are corrected for, in a line."""
    known = min(compared, REFERENCES)
    pairs = known * (known - 1) // 2 + known * (compared - known)
    return f"verdicts are corrected for {pairs} differences between {compared} methods (Holm), intervals are not"


def told(effect: Effect) -> str:
    """The verdict on an effect, and how many scenes would decide it where that can be said.

    >>> told(Effect(1.0, -0.2, 2.2, 0.5, 8, 0.2, 0.05))
    'undecided: about 34 scenes like these would decide it'
    """
    return verdict(effect.verdict, effect.enough)


def verdict(verdict: str, enough: float | None) -> str:
    """`told` of what a table holds of an effect: to two digits, as both mean and spread are estimates."""
    if verdict != "undecided" or enough is None or not np.isfinite(enough):
        return verdict
    return f"{verdict}: about {float(f'{enough:.1e}'):.0f} scenes like these would decide it"


def words(verdict: str, higher: bool) -> str:
    """A verdict in words: better or worse.

    >>> words("lower", higher=False), words("lower", higher=True), words("undecided", higher=True)
    ('better', 'worse', 'undecided')
    """
    if verdict not in ("lower", "higher"):
        return verdict
    return "better" if (verdict == "higher") == higher else "worse"
