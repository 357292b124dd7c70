"""Semi-global aggregation against a direct recursion along each of the eight paths."""

import numpy as np
import pytest
from gapped_costs import costs_and_image
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms import paths
from matbench.algorithms.paths import Paths, aggregate, penalties
from matbench.algorithms.room import Room

DIRECTIONS = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]


def twin(cost, image, small, table):
    """L(p, k) = C + min(L(q, k), L(q, k +- 1) + P1, min L(q) + P2) - min L(q), over all paths, in whole units."""
    height, planes, width = cost.shape
    total = np.zeros(cost.shape, np.int64)
    for dy, dx in DIRECTIONS:
        paths = np.zeros(cost.shape, np.int64)
        for y in range(height)[:: -1 if dy < 0 else 1]:
            for x in range(width)[:: -1 if dx < 0 else 1]:
                paths[y, :, x] = cost[y, :, x]
                if 0 <= y - dy < height and 0 <= x - dx < width:
                    last = paths[y - dy, :, x - dx]
                    jump = table[np.abs(image[y, x].astype(int) - image[y - dy, x - dx]).max()]
                    for k in range(planes):
                        moves = [last[k], last.min() + jump]
                        moves += [last[m] + small for m in (k - 1, k + 1) if 0 <= m < planes]
                        paths[y, k, x] += min(moves) - last.min()
        total += paths
    return total


STEPS = [(0.1, 0.6), (0.5, 3.0), (0.5, 0.1), (0.0, 0.0), (0.1, 50.0), (70.0, 2.0)]


@settings(max_examples=40, deadline=None)
@given(
    costs_and_image(rows=9),
    st.sampled_from(STEPS),
    st.sampled_from([1.0, 0.0, 3e-4, 2e5]),
    st.sampled_from([4, 128]),
    st.integers(1, 2),
)
def test_aggregation_is_its_twin(problem, steps, scale, band, threads):
    cost, image = problem
    cost *= np.float32(scale)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paths, "BAND", band)
        total, unit = aggregate(cost, image, *steps, 25.0, threads)
    whole = np.floor(np.nan_to_num(cost) * np.float32(unit) + np.float32(0.5)).astype(np.int64)
    table = np.rint(penalties(*steps, 25.0).astype(float) * unit).astype(np.int64)
    total = total[..., : cost.shape[2]]
    np.testing.assert_array_equal(total, twin(whole, image, round(steps[0] * unit), table))


@pytest.mark.parametrize("steps", STEPS)
def test_the_largest_cost_is_a_thousand_units_or_more(steps):
    cost, image = np.ones((1, 2, 3), np.float32), np.zeros((1, 3, 3), np.uint8)
    cost[0, 0] = 0
    total, unit = aggregate(cost, image, *steps, 25.0)
    assert unit >= 1000
    assert total.dtype == (np.uint32 if max(steps) >= 50 else np.uint16)
    np.testing.assert_array_equal(total[:, 0, :3] < total[:, 1, :3], True)


def test_threads_change_nothing():
    rng = np.random.default_rng(0)
    cost, image = rng.random((150, 9, 30), np.float32), rng.integers(0, 256, (150, 30, 3), dtype=np.uint8)
    one, two = (aggregate(cost, image, 0.5, 3.0, 25.0, threads)[0] for threads in (1, 2))
    np.testing.assert_array_equal(one[..., :30], two[..., :30])


def test_penalties_fall_with_contrast_to_the_small_step():
    table = penalties(0.5, 3.0, 25.0)
    assert table[0] == 3
    assert table[255] == 0.5
    assert (np.diff(table) <= 0).all()


def test_bytes_are_those_of_the_arrays(monkeypatch):
    how, room, taken = Paths.of(0.2, 1.0, 25.0, 1.0), Room(), []
    empty = Room.empty
    monkeypatch.setattr(Room, "empty", lambda self, *what: taken.append(what) or empty(self, *what))
    cost = np.zeros((150, 3, 9), np.float32)
    how.sums(how.whole(cost, room), np.zeros((150, 9, 3), np.uint8), room)
    large = {name: shape for name, shape, _ in taken[::-1] if name in ("whole", "total", "turned", "along")}
    assert how.held(cost.shape) == 2 * sum(np.prod(shape) for shape in large.values())
