"""Scanline optimisation against all maps of a row there are, and on scenes."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.scanline import Scanline, best_rows
from matbench.parameters import silent_in


@settings(max_examples=30, deadline=None)
@given(width=st.integers(1, 5), planes=st.integers(1, 4), step=st.integers(1, 3), seed=st.integers(0, 999))
def test_no_map_of_a_row_costs_less(width: int, planes: int, step: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    cost = rng.random((3, width, planes), np.float32)
    weights = rng.random((3, width - 1), np.float32) * 0.5
    found = np.empty((3, width), np.float32)
    energies = best_rows(cost, weights, step, found)

    def energy(y: int, labels: tuple[int, ...]) -> float:
        own = sum(cost[y, x, k] for x, k in enumerate(labels))
        return float(own + sum(w * min(abs(a - b), step) for w, a, b in zip(weights[y], labels, labels[1:])))  # noqa: B905

    for y in range(3):
        least = min(energy(y, labels) for labels in product(range(planes), repeat=width))
        assert energies[y] == pytest.approx(least, abs=1e-5)
        assert energy(y, tuple(int(k) for k in found[y])) == pytest.approx(least, abs=1e-5)


def test_rows_and_threads_are_independent() -> None:
    scene = load_scene("synthetic/box")
    once, twice = (Scanline().solve(scene, Context(threads=threads)) for threads in (1, 2))
    np.testing.assert_array_equal(once.disparity[scene.ref], twice.disparity[scene.ref])
    assert once.history == twice.history
    assert once.work == twice.work


def test_smoothness_makes_fewer_changes_at_a_higher_cost() -> None:
    scene = load_scene("synthetic/box")
    changes, energies = [], []
    for smoothness in (0.5, 5, 50):
        estimate = Scanline(smoothness=smoothness).solve(scene, Context())
        changes.append(int((np.diff(estimate.disparity[scene.ref], axis=1) != 0).sum()))
        energies.append(estimate.history["energy"][0])
    assert changes == sorted(changes, reverse=True)
    assert changes[0] > changes[-1]
    assert energies == sorted(energies)


def test_parameters_without_effect_are_refused() -> None:
    assert {"difference", "truncation", "selection", "shiftable"} <= set(silent_in(Scanline(similarity="shared")))
    with pytest.raises(ValueError, match="difference"):
        Scanline(similarity="shared", difference="squared")
