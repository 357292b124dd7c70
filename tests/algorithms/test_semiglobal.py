"""Semi-global aggregation against a direct recursion along each of the eight paths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.semiglobal import SemiGlobal, aggregate, penalties, winner, winner_of_known

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


def twin_winner(total, cost):
    found = np.full(cost.shape[::2], np.nan)
    for y, x in np.ndindex(found.shape):
        known = ~np.isnan(cost[y, :, x])
        if not known.any():
            continue
        k = int(np.argmin(np.where(known, total[y, :, x], np.inf)))
        found[y, x] = k
        if 0 < k < cost.shape[1] - 1 and known[k - 1] and known[k + 1]:
            below, here, above = total[y, k - 1 : k + 2, x].astype(float)
            if here <= min(below, above) and max(below, above) > here:
                found[y, x] += (below - above) / (2 * (max(below, above) - here))
    return found


@st.composite
def problems(draw):
    shape = tuple(draw(st.integers(1, top)) for top in (6, 7, 9))
    rng = np.random.default_rng(draw(st.integers(0, 999)))
    cost = rng.random(shape, np.float32)
    cost[rng.random(shape) < draw(st.sampled_from([0, 0.2, 0.9]))] = np.nan
    return cost, rng.integers(0, 60, (*shape[::2], 3), dtype=np.uint8)


STEPS = [(0.1, 0.6), (0.5, 3.0), (0.5, 0.1), (0.0, 0.0), (0.1, 50.0), (70.0, 2.0)]


@settings(max_examples=40, deadline=None)
@given(problems(), st.sampled_from(STEPS), st.sampled_from([1.0, 0.0, 3e-4, 2e5]))
def test_aggregation_and_winner_are_their_twins(problem, steps, scale):
    cost, image = problem
    cost *= np.float32(scale)
    total, unit = aggregate(cost, image, *steps, 25.0)
    whole = np.floor(np.nan_to_num(cost) * np.float32(unit) + np.float32(0.5)).astype(np.int64)
    table = np.rint(penalties(*steps, 25.0).astype(float) * unit).astype(np.int64)
    total = total[..., : cost.shape[2]]
    np.testing.assert_array_equal(total, twin(whole, image, round(steps[0] * unit), table))
    np.testing.assert_allclose(winner(total.copy(), cost), twin_winner(total, cost), atol=1e-3)
    if not np.isnan(cost).any():
        found = np.empty(cost.shape[::2], np.float32)
        winner_of_known(total, found)
        np.testing.assert_array_equal(found, winner(total.copy(), cost))
    # the least of other totals may lie beside a lesser one that is unknown
    other = np.roll(total, 1, axis=1)
    np.testing.assert_allclose(winner(other, cost), twin_winner(other, cost), atol=1e-3)


@pytest.mark.parametrize("steps", STEPS)
def test_the_largest_cost_is_a_thousand_units_or_more(steps):
    cost, image = np.ones((1, 2, 3), np.float32), np.zeros((1, 3, 3), np.uint8)
    cost[0, 0] = 0
    total, unit = aggregate(cost, image, *steps, 25.0)
    assert unit >= 1000
    assert total.dtype == (np.uint32 if max(steps) >= 50 else np.uint16)
    np.testing.assert_array_equal(winner(total, cost), 0)


def twin_energy(cost, image, planes, small, large, edge):
    """E pixel by pixel: every pair of the eight neighbours once."""
    height, _, width = cost.shape
    whole = np.rint(planes)
    table, paid = penalties(small, large, edge), 0.0
    for y in range(height):
        for x in range(width):
            if np.isnan(whole[y, x]):
                continue
            paid += np.nan_to_num(cost[y, int(whole[y, x]), x])
            for y_old, x_old in ((y, x - 1), (y - 1, x - 1), (y - 1, x), (y - 1, x + 1)):
                if not (y_old >= 0 and 0 <= x_old < width) or np.isnan(whole[y_old, x_old]):
                    continue
                step = abs(whole[y, x] - whole[y_old, x_old])
                contrast = np.abs(image[y, x].astype(int) - image[y_old, x_old]).max()
                paid += 0 if step == 0 else small if step == 1 else table[contrast]
    return paid / planes.size


@settings(deadline=None, max_examples=30)
@given(problem=problems(), seed=st.integers(0, 99))
def test_energy_is_its_twin(problem, seed):
    cost, image = problem
    semiglobal, rng = SemiGlobal(small_step=0.1, large_step=0.7, contrast=20.0), np.random.default_rng(seed)
    planes = rng.uniform(0, cost.shape[1] - 1, cost.shape[::2]).astype(np.float32)
    planes[rng.random(planes.shape) < 0.1] = np.nan
    expected = twin_energy(cost, image, planes, 0.1, 0.7, 20.0)
    np.testing.assert_allclose(semiglobal.energy(cost, image, planes), expected, rtol=1e-5)


def test_threads_change_nothing():
    rng = np.random.default_rng(0)
    cost, image = rng.random((20, 9, 30), np.float32), rng.integers(0, 256, (20, 30, 3), dtype=np.uint8)
    one, two = (aggregate(cost, image, 0.5, 3.0, 25.0, threads)[0] for threads in (1, 2))
    np.testing.assert_array_equal(one[..., :30], two[..., :30])


def test_unknown_pixels_answer_nothing_and_pass_messages_on():
    cost = np.ones((3, 5, 9), np.float32)
    cost[:, 2] = 0
    cost[..., 4] = np.nan
    found = SemiGlobal().infer(cost, np.zeros((3, 9, 3), np.uint8))
    assert np.isnan(found[:, 4]).all()
    np.testing.assert_array_equal(found[:, [0, 3, 5, 8]], 2)


def test_fit_lies_between_planes():
    planes = np.arange(9, dtype=np.float32)
    cost = np.broadcast_to(np.abs(planes - 4.3)[:, None], (4, 9, 4)).astype(np.float32)
    image = np.zeros((4, 4, 3), np.uint8)
    # neighbours pull a little towards the plane they agree on
    np.testing.assert_allclose(SemiGlobal().infer(cost, image), 4.3, atol=0.1)
    np.testing.assert_allclose(SemiGlobal(small_step=0, large_step=0).infer(cost, image), 4.3, atol=1e-3)


def test_penalties_fall_with_contrast_to_the_small_step():
    table = penalties(0.5, 3.0, 25.0)
    assert table[0] == 3
    assert table[255] == 0.5
    assert (np.diff(table) <= 0).all()


@pytest.mark.parametrize(("name", "value"), [("small_step", -1.0), ("large_step", -1.0), ("contrast", 0.0)])
def test_a_wrong_value_names_the_parameter(name, value):
    with pytest.raises(ValueError, match=name):
        SemiGlobal(**{name: value})
