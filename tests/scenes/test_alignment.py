"""Where views were taken: on matches that are known, with false ones among them."""

from collections.abc import Mapping

import numpy as np
import pytest

from matbench.scenes.alignment import ENOUGH, Matches, _mutual, disparities, places, rows


def _matches(
    steps: Mapping[int, float], disparity: np.ndarray, false: float = 0.0, seed: int = 0
) -> dict[int, Matches]:
    """Every feature in every view, a share of them anywhere."""
    rng, count = np.random.default_rng(seed), len(disparity)
    points = rng.uniform(0, 300, (count, 2))
    found = {}
    for view, step in steps.items():
        across = -step * disparity + rng.normal(0, 0.1, count)
        wrong = rng.random(count) < false
        across[wrong] = rng.uniform(-250, 250, wrong.sum())
        found[view] = Matches(np.arange(count), points, across, rng.normal(0, 0.1, count))
    return found


@pytest.mark.parametrize("false", [0.0, 0.15])
@pytest.mark.parametrize("signed", [False, True])
def test_places_are_found_whatever_the_disparities(false: float, signed: bool) -> None:
    disparity = np.random.default_rng(1).uniform(-4 if signed else 2, 6, 300)
    found = places(_matches({0: -2, 1: -1, 3: 1, 4: 2.5}, disparity, false), 5, 2)
    assert found is not None
    np.testing.assert_allclose(found * 4.5 / 4, [-2, -1, 0, 1, 2.5], atol=0.08)  # their mean step is 1


def test_the_order_is_found_and_disparities_follow() -> None:
    disparity = np.random.default_rng(1).uniform(2, 6, 200)
    matches = _matches({0: -2, 1: 1, 3: -1, 4: 2}, disparity, false=0.1)
    found = places(matches, 5, 2)
    assert found is not None
    np.testing.assert_allclose(found, [-2, 1, 0, -1, 2], atol=0.05)
    measured = np.sort(disparities(matches, found))
    assert 150 < len(measured) <= 200
    assert disparity.min() - 0.3 < measured[0] < measured[-1] < disparity.max() + 0.3


def test_of_two_views_every_match_counts() -> None:
    disparity = np.linspace(1, 5, 50)
    np.testing.assert_allclose(disparities(_matches({1: 1}, disparity), [0, 1]), disparity, atol=0.5)


def test_too_few_matches_say_nothing() -> None:
    few = _matches({0: -1, 2: 1}, np.linspace(1, 5, ENOUGH - 1))
    assert places(few, 3, 1) is None
    assert len(disparities(few, [-1, 0, 1])) == 0
    assert rows(few[0]) is None
    one = {0: few[0], 2: _matches({2: 1}, np.linspace(1, 5, 40))[2]}
    found = places(one, 3, 1)
    assert found is not None
    assert np.isnan(found[0])
    assert len(disparities(one, [-1, 0, 1])) == 40, "a view without matches is no view"


@pytest.mark.parametrize(("offset", "turn"), [(0.0, 0.0), (1.5, 0.0), (-0.4, 0.02), (0.0, -0.01)])
def test_rows_are_a_plane_and_false_matches_are_none(offset: float, turn: float) -> None:
    matches = _matches({1: 1}, np.linspace(1, 5, 400))[1]
    down = matches.down + offset + turn * (matches.points[:, 0] - 150)
    down[::9] += np.random.default_rng(3).uniform(-15, 15, len(down[::9]))
    found = rows(Matches(matches.indices, matches.points, matches.across, down))
    assert found is not None
    assert found.offset == pytest.approx(offset + turn * (matches.points[:, 0].mean() - 150), abs=0.05)
    plane = np.abs(offset + turn * (matches.points[:, 0] - 150))
    assert found.worst == pytest.approx(np.quantile(plane, 0.98), abs=0.1)


def test_mutual_choice_has_a_slow_twin() -> None:
    rng = np.random.default_rng(0)
    a = rng.normal(size=(40, 8)).astype(np.float32)
    b = np.concatenate([a[::2] + rng.normal(0, 0.2, (20, 8)), rng.normal(size=(15, 8))]).astype(np.float32)
    distance = np.array([[np.linalg.norm(x - y) for y in b] for x in a])
    slow = []
    for i in range(len(a)):
        j = int(np.argmin(distance[i]))
        second = np.sort(distance[i])[1]
        if distance[i, j] < 0.7 * second and int(np.argmin(distance[:, j])) == i:
            slow.append((i, j))
    mine, hits = _mutual(a, b)
    assert list(zip(mine.tolist(), hits.tolist(), strict=True)) == slow
    assert len(slow) > 10
    assert len(_mutual(a[:1], b)[0]) == len(_mutual(a, b[:0])[0]) == 0
