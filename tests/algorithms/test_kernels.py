"""What loops are made of, against NumPy and Python."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.kernels import add, fill, kernel, literal, popcount


@kernel
def filled(value, row):
    fill(value, row)


@kernel
def added(values, row):
    add(values, row)


@kernel
def counted(words, out):
    for x in range(words.size):
        out[x] = popcount(words[x])


@kernel
def divided(a, b):
    return a / b


@literal
def _sum(values):
    total = np.float32(0)
    for x in range(values.size):
        total += values[x]
    return total


@kernel
def summed(values):
    return _sum(values)


@pytest.mark.parametrize("count", [0, 1, 17])
def test_rows_are_filled_and_added(count):
    row = np.arange(count, dtype=np.float32)
    added(np.full(count, 0.5, np.float32), row)
    np.testing.assert_array_equal(row, np.arange(count) + 0.5)
    filled(np.float32(3), row)
    np.testing.assert_array_equal(row, np.full(count, 3))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 2**16 - 1), min_size=1, max_size=40), st.sampled_from([np.uint16, np.uint64]))
def test_bits_are_counted(words, kind):
    found = np.empty(len(words), np.int64)
    counted(np.array(words, kind), found)
    assert found.tolist() == [word.bit_count() for word in words]


def test_infinite_and_unknown_stay_what_they_are():
    assert divided(1.0, 0.0) == np.inf
    assert np.isnan(divided(0.0, 0.0))
    assert np.isnan(divided(np.nan, 1.0))


def test_a_literal_sum_is_added_up_as_written():
    values = np.random.default_rng(0).normal(0, 1e4, 10_001).astype(np.float32)
    total = np.float32(0)
    for value in values:
        total += value
    assert summed(values) == total
    assert summed(values) != values.sum(), "in another order it is another number"
