"""Dynamic programming over two views against a plain recursion, and on scenes whose answer is known."""

from functools import cache

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.dynamic_programming import DynamicProgramming, from_before, match_rows
from matbench.parameters import silent_in
from matbench.scene import Range, Scene

NEVER = float("inf")


def slow_row(cost: NDArray[np.float32], weights: NDArray[np.float32], occlusion: float) -> tuple[float, list[float]]:
    """Energy and planes of the cheapest path, by the seven transitions of the taxonomy; "M", "L" and "R" are states."""
    width, planes = cost.shape

    @cache
    def best(x: int, k: int, state: str) -> tuple[float, tuple[tuple[int, str, int], ...]]:
        if not 0 <= k < planes:
            return NEVER, ()
        own = float(cost[x, k]) if state == "M" else occlusion
        if x == 0:  # the first pixel is matched
            return (own if state == "M" else NEVER), ((x, state, k),)
        smooth = float(weights[x - 1])
        came = {
            "M": [(x - 1, k, "M", 0.0), (x - 1, k - 1, "L", smooth), (x - 1, k, "R", smooth)],
            "L": [(x - 1, k, "M", 0.0), (x - 1, k - 1, "L", 0.0)],
            "R": [(x, k + 1, "M", 0.0), (x, k + 1, "R", 0.0)],
        }[state]
        options = [(best(*one[:3])[0] + one[3], best(*one[:3])[1]) for one in came]
        total, path = min(options, default=(NEVER, ()), key=lambda one: one[0])
        return total + own, (*path, (x, state, k))

    energy, path = min((best(width - 1, k, "M") for k in range(planes)), key=lambda one: one[0])
    found = [float("nan")] * width
    for x, state, k in path:
        if state == "M":
            found[x] = k
    return energy, found


@settings(max_examples=40, deadline=None)
@given(
    width=st.integers(1, 8), planes=st.integers(1, 5), seed=st.integers(0, 999), occlusion=st.sampled_from([0.1, 0.4])
)
def test_agrees_with_a_plain_recursion(width: int, planes: int, seed: int, occlusion: float) -> None:
    rng = np.random.default_rng(seed)
    cost = rng.random((2, width, planes), np.float32)
    weights = rng.random((2, width - 1), np.float32) * 0.3
    found = np.empty((2, width), np.float32)
    energies = match_rows(cost, weights, occlusion, found)
    for y in range(2):
        energy, planes_there = slow_row(cost[y], weights[y], occlusion)
        assert energies[y] == pytest.approx(energy, abs=1e-6)
        np.testing.assert_array_equal(found[y], planes_there)


def box_before_wall(mirrored: bool) -> tuple[Scene, NDArray[np.float32], NDArray[np.bool_]]:
    """A noisy box of disparity 4 before a wall of 1; the truth of the reference view, and what the other sees of it."""
    wall, box = (np.random.default_rng(seed).integers(0, 256, (6, 80, 3), np.uint8) for seed in (1, 2))
    x = np.arange(48)
    views = []
    for j in range(2):
        on_box, on_wall = x + 4 * j, x + j
        views.append(np.where(((on_box >= 20) & (on_box < 32))[:, None], box[:, on_box], wall[:, on_wall]))
    truth = np.broadcast_to(np.where((x >= 20) & (x < 32), 4, 1), (6, 48)).astype(np.float32)
    there = x - truth
    covered = (truth == 1) & (there >= 16) & (there < 28)
    seen = (there >= 0) & ~covered
    images = np.stack(views)
    if mirrored:
        images, truth, seen = images[::-1, :, ::-1], truth[:, ::-1], seen[:, ::-1]
    ref = 1 if mirrored else 0
    return Scene("box", images, ("l", "r"), ref, Range(0, 6), {ref: truth}, 1), truth, seen


@pytest.mark.parametrize("mirrored", [False, True])
def test_what_one_view_does_not_see_takes_the_wall(mirrored: bool) -> None:
    scene, truth, seen = box_before_wall(mirrored)
    sparse = DynamicProgramming(fill=False).solve(scene, Context())
    found = sparse.disparity[scene.ref]
    inside = np.s_[:, 6:-6]  # beyond, the other view ends
    np.testing.assert_array_equal(np.isnan(found)[inside], ~seen[inside])
    np.testing.assert_array_equal(found[seen & ~np.isnan(found)][5:], truth[seen & ~np.isnan(found)][5:])
    assert sparse.work["pixels_hidden"] == np.isnan(found).sum()
    filled = DynamicProgramming().solve(scene, Context()).disparity[scene.ref]
    np.testing.assert_array_equal(filled[inside], truth[inside])


def test_holes_take_what_is_before_them() -> None:
    nan = float("nan")
    planes = np.array([[1, nan, nan, 4], [2, 3, nan, nan]], np.float32)
    np.testing.assert_array_equal(from_before(planes), [[1, 1, 1, 4], [2, 3, 3, 3]])


def test_the_pair_of_many_views_and_threads() -> None:
    scene = load_scene("synthetic/box")
    once, twice = (DynamicProgramming().solve(scene, Context(threads=threads)) for threads in (1, 2))
    np.testing.assert_array_equal(once.disparity[scene.ref], twice.disparity[scene.ref])
    assert once.history == twice.history
    wrong = np.abs(once.disparity[scene.ref] - scene.truth[scene.ref]) * scene.pair_steps > 1
    assert wrong[scene.regions["nonocc"]].mean() < 0.1


def test_views_that_are_not_of_the_pair_are_not_read() -> None:
    scene = load_scene("synthetic/box")
    views = scene.views.copy()
    views[[j for j in range(scene.n) if j not in (scene.ref, scene.ref + round(scene.pair_steps))]] = 0
    expected = DynamicProgramming().solve(scene, Context()).disparity[scene.ref]
    found = DynamicProgramming().solve(evolve(scene, views=views), Context()).disparity[scene.ref]
    np.testing.assert_array_equal(found, expected)


def test_what_is_not_read_is_said() -> None:
    assert not silent_in(DynamicProgramming())
    assert set(silent_in(DynamicProgramming(similarity="shared"))) == {"difference", "truncation"}
