"""Intervals: as often right as all resamples, the same for all who ask, whatever the order and the sign."""

from functools import cache
from itertools import combinations, combinations_with_replacement
from math import factorial, prod

import numpy as np
import pytest
from attrs import astuple, evolve
from numpy.typing import NDArray
from scipy.stats import nct, norm, skew, t, ttest_1samp

from matbench.measures import statistics
from matbench.measures.statistics import (
    CONFIDENCE,
    ERROR,
    FEW,
    MOST,
    POWER,
    Effect,
    intervals,
    paired_effect,
    paired_effects,
    together,
)

Rows = NDArray[np.float64]


def studentised(row: Rows, confidence: float) -> tuple[float, float]:
    """The twin: Student's interval and Hall's as they stand in his paper, the wider at each end."""
    n, g = row.size, float(skew(row))
    error, q = row.std(ddof=1) / np.sqrt(n), float(t.ppf((1 + confidence) / 2, row.size - 1))

    def hall(x: float) -> float:
        a, b = g / np.sqrt(n), 1 - g / np.sqrt(n) * (g / (6 * np.sqrt(n)) - x)
        return 3 / a * (np.cbrt(b) - 1)

    low, high = max(q, hall(q)), min(-q, hall(-q))
    return row.mean() - low * error, row.mean() - high * error


@pytest.mark.parametrize("scenes", [3, 5, 12, 100])
@pytest.mark.parametrize("confidence", [0.9, CONFIDENCE, 0.999])
def test_intervals_are_those_of_the_formulas(scenes: int, confidence: float) -> None:
    rows = np.random.default_rng(scenes).lognormal(0, 1, (20, scenes))
    ends = np.array(intervals(rows, confidence)).T
    assert ends == pytest.approx(np.array([studentised(row, confidence) for row in rows]))


def test_without_skewness_they_are_students() -> None:
    row = np.array([-1.0, -2, 0, 1, 2, 5, -5]) + 4
    wanted = ttest_1samp(row, 0).confidence_interval()
    assert [float(end) for end in intervals(row)] == pytest.approx([wanted.low, wanted.high])
    assert paired_effect(row.tolist()).p == pytest.approx(float(ttest_1samp(row, 0).pvalue))


@cache
def every_resample(scenes: int) -> tuple[Rows, Rows]:
    """All resamples apart from order: (resamples, scenes) how often each scene is in, and their probabilities."""
    chosen = np.array(list(combinations_with_replacement(range(scenes), scenes)))
    often = (chosen[:, :, None] == np.arange(scenes)).sum(axis=1)
    orders = np.array([factorial(scenes) // prod(map(factorial, row)) for row in often.tolist()], float)
    return often.astype(float), orders / orders.sum()


def enumerated(rows: Rows) -> tuple[Rows, Rows]:
    """The studentised bootstrap over every resample (Efron 1979; Hall 1988)."""
    often, shares = every_resample(rows.shape[1])
    n, mean, error = rows.shape[1], rows.mean(axis=1), rows.std(axis=1, ddof=1) / np.sqrt(rows.shape[1])
    means = rows @ often.T / n
    errors = np.sqrt(np.maximum(rows**2 @ often.T / n - means**2, 0) / (n - 1))
    away = means - mean[:, None]
    pivots = np.where(errors < 1e-9, np.copysign(np.inf, away), away / np.maximum(errors, 1e-9))
    order = np.argsort(pivots, axis=1)
    passed = np.cumsum(shares[order], axis=1)
    most = [np.take_along_axis(pivots, order, 1)[range(len(rows)), (passed < q).sum(axis=1)] for q in (0.025, 0.975)]
    return mean - most[1] * error, mean - most[0] * error


def drawn(kind: str, size: tuple[int, int]) -> Rows:
    """Differences around 0: alike, skewed, and with single scenes far off."""
    draw = np.random.default_rng(7)
    return {
        "normal": lambda: draw.normal(0, 1, size),
        "skewed": lambda: draw.exponential(1, size) - 1,
        "turned": lambda: 1 - draw.exponential(1, size),
        "heavy": lambda: draw.standard_t(3, size),
    }[kind]()


@pytest.mark.parametrize("scenes", [5, 8])
@pytest.mark.parametrize("kind", ["normal", "skewed", "heavy"])
def test_they_cover_as_often_as_an_exact_enumeration(scenes: int, kind: str) -> None:
    rows = drawn(kind, (1500 if scenes < 8 else 400, scenes))
    (low, high), (least, most) = intervals(rows), enumerated(rows)
    covered, exact = ((low <= 0) & (high >= 0)).mean(), ((least <= 0) & (most >= 0)).mean()
    assert covered > exact - 0.015
    assert covered > 0.91
    assert np.median(high - low) < 1.2 * np.median(most - least)


@pytest.mark.parametrize("kind", ["normal", "skewed", "turned", "heavy"])
def test_more_scenes_cover_as_often_as_they_say(kind: str) -> None:
    low, high = intervals(drawn(kind, (1500, 24)))
    assert 0.94 < ((low <= 0) & (high >= 0)).mean() < 0.985


def test_numbers_of_any_size_have_an_effect() -> None:
    small, large = paired_effects([[1.0, 2.0, 4.0], [1e307, 2e307, 4e307]])
    assert large.mean / 1e307 == pytest.approx(small.mean) == pytest.approx(7 / 3)
    assert large.low / 1e307 == pytest.approx(small.low)
    assert large.size == pytest.approx(small.size)


@pytest.mark.parametrize("scenes", [3, 8, 20])
def test_neither_order_nor_sign_nor_company_changes_an_interval(scenes: int) -> None:
    random = np.random.default_rng(0)
    rows = random.normal(0, 1, (50, scenes)).round(2)
    low, high = intervals(rows)
    shuffled = random.permuted(rows, axis=1)
    for found in (intervals(shuffled), [-end for end in intervals(-shuffled)[::-1]]):
        assert np.array_equal(found[0], low)
        assert np.array_equal(found[1], high)
    for row, a, b in zip(rows, low, high, strict=True):
        assert paired_effect(list(row[::-1])).low == a
        assert paired_effect(list(-row)).low == -b
        assert paired_effect(list(row[::-1])).p == paired_effect(list(-row)).p
    assert [e.high for e in paired_effects([*rows[:7], [1.0, 2.0], *rows[7:]])][8:] == high[7:].tolist()


def test_p_is_where_the_interval_leaves_nothing_out() -> None:
    for row in np.random.default_rng(2).lognormal(0, 1, (20, 9)) - 1:
        effect = paired_effect(list(row))
        wide, tight = (intervals(row, 1 - effect.p * factor) for factor in (0.98, 1.02))
        assert wide[0] < 0 < wide[1]
        assert tight[0] > 0 or tight[1] < 0
        assert (effect.verdict == "undecided") == (effect.low <= 0 <= effect.high)


def test_the_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    draw = np.random.default_rng(1)
    held = 0
    for _ in range(300):
        median, low, high = statistics.median_interval(draw.exponential(size=25))
        assert low <= median <= high
        held += low <= np.log(2) <= high
    assert held >= 282


def test_many_effects_are_each_its_own() -> None:
    rows = [[1.0, 2, 4, 3, 5, 2.5], [0.5], [], [1, np.nan, 2], [2.0, 2.0], [0.0, 0.0]]
    for row, found in zip(rows, paired_effects(rows), strict=True):
        assert np.array_equal(astuple(found), astuple(paired_effect(row)), equal_nan=True)
    assert paired_effects(rows)[4] == Effect(2, 2, 2, float("inf"), 2, 0.0)
    assert paired_effects(rows)[5].p == 1
    assert paired_effects([]) == []


def effect(p: float, scenes: int = 20) -> Effect:
    return Effect(-1.0, -2.0, 0.0, -0.4, scenes, p)


def test_differences_beside_each_other_are_judged_more_strictly() -> None:
    """Holm's example: of four, 0.005 and 0.01 pass 0.05/4 and 0.05/3, 0.03 fails at 0.05/2, and 0.04 with it."""
    found = together([effect(p) for p in (0.01, 0.04, 0.03, 0.005)])
    assert [one.verdict for one in found] == ["lower", "undecided", "undecided", "lower"]
    assert [one.level for one in found] == pytest.approx([ERROR / 3, ERROR / 2, ERROR / 2, ERROR / 4])
    alone = together([effect(0.04), evolve(effect(0.001), scenes=FEW - 1)])
    assert [one.verdict for one in alone] == ["lower", "too few scenes"]
    assert together([]) == []


def test_among_equal_methods_few_runs_have_any_verdict() -> None:
    draw, wrong = np.random.default_rng(5), 0
    for _ in range(300):
        scores = draw.lognormal(0, 0.7, (5, 12))
        found = together(paired_effects([a - b for a, b in combinations(scores, 2)]))
        wrong += any(one.verdict != "undecided" for one in found)
    assert wrong <= 0.05 * 300


@pytest.mark.parametrize(("size", "level"), [(0.3, 0.05), (0.8, 0.05), (-0.8, 0.005), (1.5, 0.01)])
def test_so_many_scenes_would_decide(size: float, level: float) -> None:
    found = Effect(size, -9, 9, size, FEW - 1, 0.5, level).enough
    assert found is not None

    def power(scenes: int) -> float:
        return float(nct.sf(t.ppf(1 - level / 2, scenes - 1), scenes - 1, abs(size) * np.sqrt(scenes)))

    assert power(found) >= POWER - 0.02
    assert power(max(2, found - 2)) < POWER + 0.02 or found == FEW


def test_no_number_of_scenes_is_proposed_where_none_is_known() -> None:
    assert Effect(0.0, -1, 1, 0.0, 10, 1.0).enough is None
    tiny = 1.02 * (norm.ppf(0.975) + norm.ppf(POWER)) / np.sqrt(MOST)
    assert Effect(1.0, -1, 1, tiny / 1.1, 10, 0.4).enough is None
    assert Effect(1.0, -1, 1, tiny, 10, 0.4).enough is not None
    assert Effect(1.0, -1, 1, 1.0, 30, 0.06).enough is None, "so many there are already"
    assert Effect(1.0, 0.5, 1.5, 1.0, 10, 0.001).enough is None
    assert Effect(1.0, -1, 1, 5.0, 3, 0.4).enough == FEW, "the fewest"
