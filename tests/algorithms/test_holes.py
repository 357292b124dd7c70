"""Holes are filled from the farther side of their row."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from matbench.algorithms.holes import fill_from_background

NAN = np.nan


def slow(disparity: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same, pixel by pixel."""
    rows, columns = disparity.shape
    filled = disparity.copy()
    for y in range(rows):
        for x in range(columns):
            if np.isnan(disparity[y, x]):
                left = [d for d in disparity[y, :x] if not np.isnan(d)][-1:]
                right = [d for d in disparity[y, x:] if not np.isnan(d)][:1]
                filled[y, x] = min(left + right, default=NAN)
    answered = [y for y in range(rows) if not np.isnan(disparity[y]).all()]
    for y in range(rows):
        if answered:
            filled[y] = filled[min(answered, key=lambda other: (abs(other - y), other))]
    return filled


maps = arrays(
    np.float32,
    st.tuples(st.integers(1, 5), st.integers(1, 6)),
    elements=st.sampled_from([NAN, NAN, NAN, -2.5, 0.0, 1.0, 7.25]),
)


@given(maps)
def test_agrees_with_its_slow_twin(disparity: NDArray[np.float32]) -> None:
    before = disparity.copy()
    filled = fill_from_background(disparity)
    np.testing.assert_array_equal(filled, slow(disparity))
    assert filled.dtype == np.float32
    np.testing.assert_array_equal(disparity, before)


@pytest.mark.parametrize(
    ("row", "filled"),
    [
        ([5, NAN, NAN, 2], [5, 2, 2, 2]),
        ([-1, NAN, 3], [-1, -1, 3]),
        ([NAN, 4, NAN], [4, 4, 4]),
        ([NAN], [NAN]),
    ],
)
def test_takes_the_farther_side(row: list[float], filled: list[float]) -> None:
    np.testing.assert_array_equal(fill_from_background(np.array([row], np.float32)), np.array([filled], np.float32))


def test_empty_row_takes_the_nearest_row_and_of_two_the_upper() -> None:
    disparity = np.array([[NAN], [1], [NAN], [2], [NAN]], np.float32)
    np.testing.assert_array_equal(fill_from_background(disparity)[:, 0], [1, 1, 1, 2, 2])
