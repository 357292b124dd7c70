"""The winner of sums of path costs, and the energy of a map, pixel by pixel."""

import numpy as np
import pytest
from gapped_costs import costs_and_image
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.paths import penalties
from matbench.algorithms.room import Room
from matbench.algorithms.semiglobal import SemiGlobal, winner, winner_of_known


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


@settings(max_examples=40, deadline=None)
@given(costs_and_image(rows=6), st.integers(2, 60), st.integers(0, 999))
def test_the_winner_is_its_twin(problem, most, seed):
    cost, _ = problem
    total = np.random.default_rng(seed).integers(0, most, cost.shape).astype(np.uint16)
    # the least may lie beside a lesser one that is unknown
    np.testing.assert_allclose(winner(total, cost), twin_winner(total, cost), atol=1e-3)
    if not np.isnan(cost).any():
        found = np.empty(cost.shape[::2], np.float32)
        winner_of_known(total, found)
        np.testing.assert_array_equal(found, winner(total, cost))


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
@given(problem=costs_and_image(rows=6), seed=st.integers(0, 99))
def test_energy_is_its_twin(problem, seed):
    cost, image = problem
    semiglobal, rng = SemiGlobal(small_step=0.1, large_step=0.7, contrast=20.0), np.random.default_rng(seed)
    planes = rng.uniform(0, cost.shape[1] - 1, cost.shape[::2]).astype(np.float32)
    planes[rng.random(planes.shape) < 0.1] = np.nan
    expected = twin_energy(cost, image, planes, 0.1, 0.7, 20.0)
    for threads in (1, 2):
        np.testing.assert_allclose(semiglobal.energy(cost, image, planes, 1.0, threads), expected, rtol=1e-5)
    whole = np.rint(1000 * np.nan_to_num(cost)).astype(np.uint16)
    expected = twin_energy(whole / 1000, image, planes, 0.1, 0.7, 20.0)
    np.testing.assert_allclose(semiglobal.energy(whole, image, planes, 1000.0), expected, rtol=1e-5)


def test_unknown_pixels_answer_nothing_and_pass_messages_on():
    cost = np.ones((3, 5, 9), np.float32)
    cost[:, 2] = 0
    cost[..., 4] = np.nan
    found = SemiGlobal().infer(cost, np.zeros((3, 9, 3), np.uint8))
    assert np.isnan(found[:, 4]).all()
    np.testing.assert_array_equal(found[:, [0, 3, 5, 8]], 2)


def test_costs_may_be_said_to_be_larger_than_they_are():
    rng = np.random.default_rng(0)
    cost, image = rng.random((9, 5, 12), np.float32), np.zeros((9, 12, 3), np.uint8)
    found = SemiGlobal().infer(cost, image, largest=3.0)
    paths = SemiGlobal().paths(3.0)
    whole = paths.whole(cost, Room())
    np.testing.assert_array_equal(found, SemiGlobal().infer_whole(whole, paths, image, Room())[0])
    np.testing.assert_allclose(found, SemiGlobal().infer(cost, image), atol=0.05)


def test_fit_lies_between_planes():
    planes = np.arange(9, dtype=np.float32)
    cost = np.broadcast_to(np.abs(planes - 4.3)[:, None], (4, 9, 4)).astype(np.float32)
    image = np.zeros((4, 4, 3), np.uint8)
    # neighbours pull a little towards the plane they agree on
    np.testing.assert_allclose(SemiGlobal().infer(cost, image), 4.3, atol=0.1)
    np.testing.assert_allclose(SemiGlobal(small_step=0, large_step=0).infer(cost, image), 4.3, atol=1e-3)


@pytest.mark.parametrize(("name", "value"), [("small_step", -1.0), ("large_step", -1.0), ("contrast", 0.0)])
def test_a_wrong_value_names_the_parameter(name, value):
    with pytest.raises(ValueError, match=name):
        SemiGlobal(**{name: value})
