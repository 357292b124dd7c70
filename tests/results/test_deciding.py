"""Looks at a growing set of scenes: equal methods are seldom told apart, different ones soon."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from matbench.measures.statistics import CONFIDENCE, ERROR, intervals
from matbench.results.deciding import FIRST, level, look, looks, places

Rows = NDArray[np.float64]
MOST = 300


def decided_at(differences: Rows) -> int | None:
    """At how many scenes one comparison ends; None if it does not."""
    for number, count in enumerate(looks(differences.size)):
        if look(number, differences[:count].tolist()).is_decided:
            return count
    return None


def scored(draw: np.random.Generator, size: tuple[int, ...]) -> Rows:
    """Errors in per cent as methods make them: most scenes are easy, some are lost."""
    return np.where(draw.random(size) < 0.9, draw.lognormal(0.5, 0.8, size), draw.uniform(10, 60, size))


def few(draw: np.random.Generator, size: float) -> Rows:
    """Mostly about 0, one in five skewed; the mean is a fifth of `size`."""
    large = size * (draw.exponential(1, (1000, MOST)) if size > 1 else draw.lognormal(-0.5, 1, (1000, MOST)))
    return np.where(draw.random((1000, MOST)) < 0.2, large, 0.0) + draw.normal(0, 0.05 * size, (1000, MOST))


EQUAL: dict[str, Callable[[np.random.Generator], Rows]] = {
    "alike": lambda draw: draw.normal(0, 1, (1000, MOST)),
    "as methods err": lambda draw: scored(draw, (1000, MOST)) - scored(draw, (1000, MOST)),
    "skewed": lambda draw: draw.exponential(1, (1000, MOST)) - 1,
    "very skewed": lambda draw: draw.lognormal(0, 1, (1000, MOST)) - np.exp(0.5),
    "one in five decides all": lambda draw: few(draw, 5.0) - 1,
    "and skewed": lambda draw: few(draw, 1.0) - 0.2,
    "heavy tails": lambda draw: draw.standard_cauchy((1000, MOST)),
}
"""Differences of methods that are equal on average, or, where they are symmetric, equal."""


@pytest.mark.parametrize("kind", EQUAL)
def test_of_a_hundred_comparisons_of_equal_methods_at_most_five_decide(kind: str) -> None:
    rows = EQUAL[kind](np.random.default_rng(11))[: 300 if kind in ("alike", "skewed") else 1000]
    assert sum(decided_at(row) is not None for row in rows) <= ERROR * len(rows)


@pytest.mark.parametrize(("size", "most"), [(0.8, 32), (0.5, 54), (0.3, 150)])
def test_different_methods_are_told_apart(size: float, most: int) -> None:
    rows = np.random.default_rng(3).normal(-size, 1, (100, MOST))
    ends = [decided_at(row) or 10 * MOST for row in rows]
    assert np.median(ends) <= most


def test_all_intervals_hold_at_once() -> None:
    """The true difference is 1: it lies in the intervals of all looks in 95 of 100 runs or more."""
    rows, held = np.random.default_rng(4).exponential(1, (300, 100)), 0
    for row in rows:
        seen = [look(number, row[:count].tolist()).effect for number, count in enumerate(looks(100))]
        held += all(effect.low <= 1 <= effect.high for effect in seen)
    assert held >= CONFIDENCE * len(rows)


def test_a_look_is_judged_at_its_own_level() -> None:
    row = np.random.default_rng(5).normal(-1, 1, 48)
    seen = look(1, [*row.tolist(), float("nan")])
    low, high = intervals(row, 1 - level(1))
    assert (seen.effect.low, seen.effect.high) == (pytest.approx(low), pytest.approx(high))
    assert seen.effect.scenes == 48
    assert seen.is_decided == (high < 0)
    assert look(0, [-1.0] * FIRST).is_decided
    assert not look(0, [0.0] * FIRST).is_decided
    assert not look(0, [-1.0] * 3).is_decided, "too few scenes"


def test_looks_end_with_the_last_scene() -> None:
    assert looks(FIRST) == [FIRST]
    assert looks(7) == [7]
    assert looks(100) == [32, 48, 72, 100]
    assert looks(1000)[-2:] == [819, 1000]


def test_looks_are_counted_by_witnesses() -> None:
    """Three settings of each world: no look is amid those of one."""
    names = [world for world in range(50) for _ in range(3)]
    assert places(names) == [3 * 32, 3 * 48, 150]
    assert places(list(range(50)) * 2) == [32, 48, 100], "all settings of a world only at the end"
    assert places([0]) == [1]


def test_where_the_exact_test_does_not_agree_nothing_is_decided() -> None:
    """Eight scenes of 48 differ: by chance all of one sign once in 128 times, but the interval alone would decide."""
    row = np.array([1.0] * 8 + [0.0] * 40)
    low, high = intervals(row, 1 - level(1))
    seen = look(1, row.tolist())
    assert low > 0, "by itself"
    assert (seen.effect.p, seen.is_decided) == (1 / 128, False)
    assert (seen.effect.low, seen.effect.high) == (0, pytest.approx(high))
