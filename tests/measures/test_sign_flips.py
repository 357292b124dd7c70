"""The test by changes of signs is exact: against all changes one by one, and by simulation."""

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from matbench.measures.sign_flips import chance, powers

Rows = NDArray[np.float64]


def one_by_one(values: Rows) -> float:
    """Over all changes of signs."""
    sums = [abs(sum(sign * value for sign, value in zip(signs, values, strict=True))) for signs in _signs(values.size)]
    return float(np.mean([found >= sums[0] - 1e-9 for found in sums]))


def _signs(count: int) -> list[tuple[int, ...]]:
    return list(product((1, -1), repeat=count))


@pytest.mark.parametrize("count", [1, 2, 5, 9, 12])
def test_few_values_change_their_signs_in_all_ways(count: int) -> None:
    draw = np.random.default_rng(count)
    for values in (draw.normal(0.4, 1, count), draw.integers(-2, 3, count).astype(float), np.ones(count)):
        assert chance(values) == one_by_one(values)


def test_changes_of_signs_are_those_of_the_powers() -> None:
    """Twenty values: every change c, one by one, by the parity of its product with the powers."""
    values = np.random.default_rng(1).normal(0.3, 1, 20)
    odd = np.array([[(c & int(power)).bit_count() % 2 for power in powers(20)] for c in range(1 << 16)])
    sums = np.abs(((1 - 2 * odd) * values).sum(axis=1))
    assert chance(values) == pytest.approx(np.mean(sums >= sums[0] - 1e-9))


def test_no_two_values_of_many_change_their_signs_alike() -> None:
    assert len(set(powers(65535).tolist())) == 65535
    assert powers(65536)[-1] == 1, "and then they begin again"


SYMMETRIC: dict[str, Callable[[np.random.Generator], Rows]] = {
    "heavy tails": lambda draw: draw.standard_cauchy(40),
    "most are none": lambda draw: np.where(draw.random(40) < 0.2, draw.normal(0, 9, 40), 0.0),
    "a coin": lambda draw: draw.choice([-1.0, 1.0], 40),
}


@pytest.mark.parametrize("kind", SYMMETRIC)
def test_it_errs_as_often_as_it_says(kind: str) -> None:
    draw = np.random.default_rng(7)
    found = np.array([chance(SYMMETRIC[kind](draw)) for _ in range(300)])
    for level in (0.05, 0.2):  # and three standard deviations of the simulation
        assert np.mean(found <= level) <= level + 3 * np.sqrt(level * (1 - level) / found.size)


def test_a_difference_is_seen() -> None:
    draw = np.random.default_rng(8)
    assert chance(draw.normal(1, 1, 40)) < 1e-3
    assert chance(np.zeros(40)) == 1
