"""Intervals: exact for few scenes, the same for all who ask, whatever the order and the sign."""

from itertools import product

import numpy as np
import pytest
from scipy.stats import bootstrap

from matbench.measures import statistics
from matbench.measures.statistics import EXACT, Effect, intervals, paired_effect, paired_effects


@pytest.mark.parametrize("scenes", range(2, 7))
def test_few_scenes_are_resampled_in_every_way(scenes: int) -> None:
    rows = np.random.default_rng(scenes).normal(1, 2, (4, scenes))
    for row, low, high in zip(rows, *intervals(rows), strict=True):
        means = np.mean(list(product(row, repeat=scenes)), axis=1)
        assert [low, high] == pytest.approx(np.quantile(means, [0.025, 0.975]), abs=1e-12)


def test_by_hand() -> None:
    """Of 0 and 1 the four resamples have the means 0, 1/2, 1/2, 1: 0.025 of the way along three gaps is 0.0375."""
    low, high = intervals(np.array([0.0, 1.0]))
    assert (low, high) == (pytest.approx(0.0375), pytest.approx(0.9625))


def test_numbers_of_any_size_have_an_effect() -> None:
    small, large = paired_effects([[1.0, 2.0, 4.0], [1e307, 2e307, 4e307]])
    assert large.mean / 1e307 == pytest.approx(small.mean) == pytest.approx(7 / 3)
    assert large.low / 1e307 == pytest.approx(small.low)
    assert large.size == pytest.approx(small.size)


@pytest.mark.parametrize("scenes", [3, EXACT, EXACT + 1, 20])
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
    assert [e.high for e in paired_effects([*rows[:7], [1.0, 2.0], *rows[7:]])][8:] == high[7:].tolist()


def test_the_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    draw = np.random.default_rng(1)
    held = 0
    for _ in range(300):
        median, low, high = statistics.median_interval(draw.exponential(size=25))
        assert low <= median <= high
        held += low <= np.log(2) <= high
    assert held >= 282


def test_intervals_are_those_of_scipy() -> None:
    values = np.sort(np.random.default_rng(3).normal(4, 2, (3, 9)))  # in the order and sign in which they are drawn
    wanted = bootstrap((values,), np.mean, axis=-1, n_resamples=4999, method="percentile", batch=256, rng=0)
    low, high = intervals(values)
    assert low == pytest.approx(wanted.confidence_interval.low)
    assert high == pytest.approx(wanted.confidence_interval.high)


def test_many_effects_are_each_its_own() -> None:
    rows = [[1.0, 2, 4, 3, 5, 2.5], [0.5], [], [1, np.nan, 2], [2.0, 2.0], [0.0, 0.0]]
    for row, found in zip(rows, paired_effects(rows), strict=True):
        alone = paired_effect(row)
        assert np.array_equal(
            [found.mean, found.low, found.high, found.size, found.scenes],
            [alone.mean, alone.low, alone.high, alone.size, alone.scenes],
            equal_nan=True,
        )
    assert paired_effects(rows)[4] == Effect(2, 2, 2, float("inf"), 2)
