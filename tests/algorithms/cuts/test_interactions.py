"""What homologous pixels differ by, and what they earn."""

import numpy as np
import pytest
from attrs import evolve
from boxes import box_before_wall

from matbench.algorithms.cuts.interactions import UNKNOWN, Interactions, join_ways
from matbench.algorithms.sampling import fine_rows, search_space
from matbench.algorithms.similarity import pairs as view_pairs


def between(similarity="published", fineness=1, which="all", threads=1, **options):
    scene = box_before_wall(n=3, height=12, width=30, **options)
    space = search_space(scene, fineness)
    return scene, space, Interactions.of(scene, space, view_pairs(3, which, 1), similarity, threads)


@pytest.mark.parametrize("fineness", [1, 2])
def test_pairs_are_compared_where_they_are_from_either_pixel(fineness):
    scene, space, found = between(fineness=fineness)
    rows = fine_rows(scene.views, fineness)
    for p, (i, j) in enumerate(found.pairs):
        for k in range(space.planes):
            steps = (i - j) * (space.first + k)
            for x in range(space.width):
                at = x + found.shifts[p, k]
                if not 0 <= at < space.width:
                    assert (found.differences[p, :, k, x] == UNKNOWN).all()
                    continue
                ways = [(i, fineness * x, j, fineness * x + steps), (j, fineness * at, i, fineness * at - steps)]
                inside = [
                    ((rows[a, :, :, m] - rows[b, :, :, n]) ** 2).mean(axis=0)
                    for a, m, b, n in ways
                    if 0 <= n < space.samples
                ]
                wanted = np.minimum(np.mean(inside, axis=0), (UNKNOWN - 1) / found.units)
                np.testing.assert_allclose(found.differences[p, :, k, x] / found.units, wanted, atol=0.02)


@pytest.mark.parametrize("similarity", ["published", "shared"])
def test_the_truth_differs_least_and_threads_change_nothing(similarity):
    scene, space, found = between(similarity)
    for p, (i, j) in enumerate(found.pairs):
        assert (
            found.differences[p][:, 1 - space.first][:3] < found.differences[p][:, 2 - space.first][:3]
        ).mean() > 0.9
        assert (i, j) in {(0, 1), (0, 2), (1, 2)}
    again = Interactions.of(scene, space, found.pairs, similarity, 3)
    np.testing.assert_array_equal(found.differences, again.differences)


def test_one_way_that_leaves_the_picture_leaves_the_other():
    forth = np.array([[[1, np.nan, np.nan]]], np.float32)
    back = np.array([[[7, 3, np.nan]]], np.float32)
    out = np.empty((1, 1, 3), np.uint16)
    join_ways(forth, back, np.array([1]), np.float32(2), 0, 1, out)
    assert out.tolist() == [[[4, UNKNOWN, UNKNOWN]]]


def test_rewards_are_never_positive_and_nothing_without_a_pair():
    _, _, found = between()
    earned = found.rewards(5.0)
    limit = round(5 * found.units)
    np.testing.assert_array_equal(earned, np.minimum(0, found.differences.astype(int) - limit))
    assert earned.min() == -limit
    assert not earned[found.differences == UNKNOWN].any()


def test_the_usual_difference_is_one_of_the_smallest_of_each_pixel():
    _, space, found = between(wall=1, box=6)
    rank = max(3, (space.planes + 2) // 4) - 1
    known = found.differences.astype(float)
    known[found.differences == UNKNOWN] = np.inf
    ranked = np.sort(known, axis=2)[:, :, rank]
    assert found.usual_difference() == pytest.approx(ranked[np.isfinite(ranked)].mean() / found.units)


@pytest.mark.parametrize("fineness", [1, 2])
def test_either_way_the_usual_difference_is_the_same_in_a_mirror(fineness):
    views = np.random.default_rng(2).integers(0, 256, (3, 6, 24, 3)).astype(np.uint8)
    scene = box_before_wall(n=3, height=6, width=24)
    found = []
    for seen in (views, views[::-1, :, ::-1].copy()):
        shown = evolve(scene, views=seen, truth={}, regions={}, visible={})
        space = search_space(shown, fineness)
        between = Interactions.of(shown, space, view_pairs(3, "consecutive", 1), "published", 1, by_ranges=True)
        found.append(between.usual_difference(both_ways=True))
    assert found[0] == pytest.approx(found[1])
    assert found[0] > 0
