"""Rows shared out to threads."""

import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from matbench.algorithms.parallel import over_rows, over_views, share


@given(st.integers(0, 70), st.integers(1, 4), st.integers(1, 20))
def test_every_row_is_worked_on_once(rows, threads, block):
    calls = []
    over_rows(lambda first, end: calls.append((first, end)), rows, threads, block)
    assert sorted(row for first, end in calls for row in range(first, end)) == list(range(rows))
    assert all(0 < end - first <= block for first, end in calls)


@given(st.integers(0, 9), st.integers(0, 70), st.integers(0, 4))
def test_every_row_of_every_view_is_worked_on_once_and_each_thread_has_as_many_parts(views, rows, threads):
    calls = []
    over_views(lambda *part: calls.append(part), views, rows, threads)
    done = sorted((view, row) for view, first, end in calls for row in range(first, end))
    assert done == [(view, row) for view in range(views) for row in range(rows)]
    assert rows < max(1, threads) ** 2 or len(calls) == views * max(1, threads)


@given(st.integers(0, 5000), st.integers(0, 64))
def test_shares_balance_the_load(rows, threads):
    each, many = share(rows, threads), 8 * threads if threads > 1 else 1
    assert each >= 1
    assert each * many >= rows, "eight calls a thread are enough, and one if it is alone"
    assert each == 1 or (each - 1) * many < rows, "and no more rows a call than that"


def test_one_thread_is_the_caller_and_several_work_at_once():
    mine = threading.get_ident()
    names = set()
    over_rows(lambda *_: names.add(threading.get_ident()), 64, 1)
    assert names == {mine}
    together = threading.Barrier(2, timeout=60)
    over_rows(lambda *_: together.wait(), 32, 2)  # neither call ends before the other has begun
    assert together.broken is False


@pytest.mark.parametrize("threads", [1, 2])
def test_what_a_block_raises_is_raised(threads):
    def work(first, _):
        if first == 16:
            raise ArithmeticError("row 16")

    with pytest.raises(ArithmeticError, match="row 16"):
        over_rows(work, 48, threads)
