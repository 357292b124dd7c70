"""The winner over shiftable windows, on scenes whose answer is known."""

import numpy as np
import pytest

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.ssd import SSD
from matbench.algorithms.sweep import Sweep
from matbench.parameters import parameters
from matbench.scene import Range, Scene


def test_it_is_the_plane_of_least_cost() -> None:
    scene = load_scene("synthetic/box")
    method = SSD(window=5)
    estimate = method.solve(scene, Context())
    sweep = Sweep.of(scene, method.costs)
    nearest = sweep.disparity(sweep.cost().argmin(axis=2).astype(np.float32))
    np.testing.assert_array_equal(estimate.disparity[scene.ref], nearest)
    assert estimate.work == sweep.work


def test_a_fit_moves_answers_by_half_a_plane_at_most() -> None:
    scene = load_scene("synthetic/slanted[size=48x36 n=3]")
    whole, between = (
        SSD(window=5, fit=fit, fineness=1).solve(scene, Context()).disparity[scene.ref] for fit in (False, True)
    )
    moved = np.abs(between - whole)
    assert 0 < moved.max() <= 0.5 + 1e-6


def test_defaults_are_those_of_the_published_row() -> None:
    known = parameters(SSD)
    assert {name: known[name].default for name in ("difference", "window", "shiftable", "truncation")} == {
        "difference": "squared",
        "window": 21,
        "shiftable": True,
        "truncation": 0.0,
    }


@pytest.mark.parametrize("similarity", ["published", "shared"])
def test_a_wall_is_found(similarity: str) -> None:
    texture = np.random.default_rng(3).integers(0, 256, (14, 60, 3), np.uint8)
    views = np.stack([texture[:, 2 * j : 2 * j + 40] for j in range(4)])
    scene = Scene("wall", views, tuple("0123"), 1, Range(0, 4), {}, 1)
    once, twice = (
        SSD(similarity=similarity, window=5).solve(scene, Context(threads=threads)).disparity[1] for threads in (1, 2)
    )
    np.testing.assert_allclose(once[:, 8:-8], 2, atol=0.2)
    np.testing.assert_array_equal(once, twice)


def test_windows_that_shift_keep_outlines() -> None:
    scene = load_scene("synthetic/box")
    wrong = []
    for shiftable in (False, True):
        found = SSD(window=9, shiftable=shiftable).solve(scene, Context()).disparity[scene.ref]
        bad = np.abs(found - scene.truth[scene.ref]) * scene.pair_steps > 1
        wrong.append(bad[scene.regions["disc"]].mean())
    assert wrong[1] < wrong[0]
