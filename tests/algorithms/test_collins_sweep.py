"""Votes of edges, against a plain count and on scenes whose answer is known."""

import numpy as np
import pytest
from scipy.stats import binom

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.collins_sweep import CollinsSweep, edges_of, significant
from matbench.algorithms.sweep import Costs, Sweep
from matbench.scene import Range, Scene


def bars(disparity: int) -> Scene:
    """Upright bars at random places before black, in four views."""
    texture = np.repeat(np.random.default_rng(0).integers(0, 2, (1, 40)) * 200, 3, axis=1).repeat(16, axis=0)
    wide = np.repeat(texture[..., None], 3, axis=2).astype(np.uint8)
    views = np.stack([wide[:, disparity * j : disparity * j + 90] for j in range(4)])
    return Scene("bars", views, tuple("0123"), 1, Range(0, 6), {}, 1)


@pytest.mark.parametrize("disparity", [0, 2, 5])
def test_answers_are_edges_and_mostly_right(disparity: int) -> None:
    scene = bars(disparity)
    estimate = CollinsSweep().solve(scene, Context())
    found = estimate.disparity[1]
    known = np.isfinite(found)
    assert 0 < known.sum() == estimate.work["edge_pixels_placed"] < estimate.work["edge_pixels"] + 1
    assert not (known & ~edges_of(scene.views[1], 50, 120)).any()
    assert (found[known] == disparity).mean() > 0.8


def test_chance_is_that_of_a_plain_count() -> None:
    scene = load_scene("synthetic/box")
    rows = Scene("rows", scene.views[:, 80:92], tuple("01234"), 2, scene.disparities, {}, 2)
    sweep = Sweep.of(rows, Costs())
    rng = np.random.default_rng(0)
    wide = (rng.random(sweep.scene.views.shape[:3]) < 0.3).astype(np.uint8)
    asked = rng.random(wide.shape[1:]) < 0.02
    chance = CollinsSweep._chance(sweep, asked, wide, 1)
    for place, (y, x) in enumerate(zip(*np.nonzero(asked), strict=True)):
        for plane in range(sweep.space.planes):
            votes = held = 0
            for view in sweep.others:
                exact = (view - 2) * (sweep.space.first + plane) / sweep.space.fineness
                there = x - int(np.sign(exact) * np.floor(abs(exact) + 0.5))
                if 0 <= there < sweep.space.width:
                    held, votes = held + 1, votes + int(wide[view, y, there])
            assert chance[place, plane] == pytest.approx(binom.sf(votes - 1, held, wide.mean()))


def test_only_what_is_significant_and_clear_is_answered() -> None:
    chance = np.array(
        [[0.5, 0.001, 0.5, 0.5], [0.5, 0.02, 0.5, 0.5], [0.5, 0.001, 0.001, 0.5], [0.001, 0.5, 0.001, 0.5]]
    )
    np.testing.assert_array_equal(significant(chance, 0.01), [1, np.nan, 1.5, np.nan])


def test_wider_edges_are_less_significant() -> None:
    scene = bars(2)
    placed = [CollinsSweep(radius=radius).solve(scene, Context()).work["edge_pixels_placed"] for radius in (0, 1)]
    assert placed[0] > placed[1]


def test_edges_along_the_rows_say_nothing() -> None:
    image = np.zeros((20, 20, 3), np.uint8)
    image[10:] = 200
    assert not edges_of(image, 50, 120).any()
    assert edges_of(np.ascontiguousarray(image.transpose(1, 0, 2)), 50, 120).any()


def test_dense_answers_everywhere_and_keeps_the_sparse_ones() -> None:
    scene = bars(2)
    sparse, dense = (
        CollinsSweep(dense=dense).solve(scene, Context(threads=threads)).disparity[1]
        for dense, threads in ((False, 1), (True, 2))
    )
    known = np.isfinite(sparse)
    assert 0 < known.mean() < 1
    assert np.isfinite(dense).all()
    np.testing.assert_array_equal(dense[known], sparse[known])


def test_the_less_likely_by_chance_the_surer() -> None:
    scene = bars(2)
    estimate = CollinsSweep(dense=True).solve(scene, Context())
    sparse = CollinsSweep().solve(scene, Context()).disparity[scene.ref]
    sure = estimate.confidence[scene.ref]
    assert (sure[np.isnan(sparse)] == 0).all(), "what is filled from others is not sure"
    assert sure[np.isfinite(sparse)].min() > 0
    assert sure.max() < 1


@pytest.mark.parametrize("wrong", [{"strong": 10}, {"significance": 0}, {"radius": -1}])
def test_wrong_parameters(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        CollinsSweep(**wrong)  # type: ignore[arg-type]
