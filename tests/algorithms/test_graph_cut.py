"""The cut over costs, on scenes whose answer is known."""

import numpy as np
import pytest
from boxes import box_before_wall

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.graph_cut import GraphCut


@pytest.mark.parametrize("similarity", ["published", "shared"])
def test_a_box_before_a_wall_is_found(similarity):
    scene = box_before_wall(height=30, width=50)
    found = GraphCut(similarity=similarity).solve(scene, Context()).disparity[scene.ref]
    assert np.mean(np.abs(found - scene.truth[scene.ref]) > 0.5) < 0.04


def test_the_answer_depends_on_neither_context_nor_library():
    scene = load_scene("synthetic/box[size=64x48]")
    first = GraphCut().solve(scene, Context())
    for method, context in (
        (GraphCut(), Context(seed=5, threads=3)),
        (GraphCut(flow="scipy"), Context()),
    ):
        again = method.solve(scene, context)
        np.testing.assert_array_equal(first.disparity[scene.ref], again.disparity[scene.ref])
        assert again.history == first.history
        assert again.work == first.work


def test_the_energy_falls_and_rounds_are_counted():
    scene = load_scene("synthetic/slanted[size=64x48]")
    estimate = GraphCut(rounds=2, order=3).solve(scene, Context())
    energies = estimate.history["energy"]
    assert len(energies) <= 3
    assert list(energies) == sorted(energies, reverse=True)
    assert energies[0] > energies[-1]
    planes = len(np.unique(estimate.disparity[scene.ref]))
    assert estimate.work["expansions"] >= planes
    assert estimate.work["arcs"] > 0


def test_a_higher_price_makes_fewer_changes():
    scene = load_scene("synthetic/box[size=64x48]")
    changes = [
        np.count_nonzero(np.diff(GraphCut(smoothness=price).solve(scene, Context()).disparity[scene.ref]))
        for price in (1, 10, 100)
    ]
    assert changes == sorted(changes, reverse=True)
    assert changes[0] > changes[-1]


def test_parameters_without_effect_are_refused():
    with pytest.raises(ValueError, match="flat other than 1"):
        GraphCut(flat=1.0, edge=3.0)
    with pytest.raises(ValueError, match="similarity=published"):
        GraphCut(similarity="shared", truncation=20.0)
