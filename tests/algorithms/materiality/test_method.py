"""Materiality and its control on small scenes of known truth, whatever the solver."""

import numpy as np
import pytest
from attrs import evolve
from boxes import FISTA, box_before_wall

from matbench.algorithm import Algorithm, Context
from matbench.algorithms.materiality import Materiality
from matbench.algorithms.multiview_sgm import MultiviewSGM
from matbench.scene import Range, Scene

PAPER = Materiality(**Materiality.presets["paper"])


def wrong(method, scene, **context):
    """Share of the reference view's pixels off by more than half a pixel, in per cent."""
    found = method.solve(scene, Context(**context)).disparity[scene.ref]
    return 100 * float(np.mean(~(np.abs(found - scene.truth[scene.ref]) <= 0.5)))


@pytest.mark.parametrize("method", [Materiality(), MultiviewSGM(), Materiality(binarization="ray"), FISTA])
@pytest.mark.parametrize(("wall", "box"), [(1, 4), (-3, 0), (-4, -2)])
def test_finds_both_surfaces(method, wall, box):
    scene = box_before_wall(wall=wall, box=box)
    assert isinstance(method, Algorithm)
    assert wrong(method, scene) < 6


def test_visibility_helps_where_views_are_hidden():
    scene = box_before_wall(n=5, ref=0, box=6, height=40, width=60)
    for method in (Materiality(), FISTA):
        assert wrong(method, scene) < wrong(MultiviewSGM(), scene)


def test_results_do_not_depend_on_threads():
    scene = box_before_wall(height=40)
    ray, soft = Materiality(passes=2, binarization="ray"), Materiality(start="soft", adaptive=0.0)
    for method in (Materiality(passes=2), ray, soft, MultiviewSGM(), PAPER, FISTA, evolve(FISTA, counted="global")):
        one, two = (method.solve(scene, Context(threads=threads)) for threads in (1, 2))
        np.testing.assert_array_equal(one.disparity[1], two.disparity[1])
        assert one.history == two.history
        if one.volume is not None:
            np.testing.assert_array_equal(one.volume.values, two.volume.values)


def test_mirrored_scene_gives_the_mirrored_map():
    scene = box_before_wall(n=3, ref=1)
    mirrored = evolve(scene, views=scene.views[::-1, :, ::-1], truth={}, regions={})
    for method in (Materiality(), MultiviewSGM()):
        found = method.solve(scene, Context()).disparity[1]
        other = method.solve(mirrored, Context()).disparity[1][:, ::-1]
        assert np.mean(np.abs(found - other) > 0.05) < 0.01


@pytest.mark.parametrize(
    ("n", "height", "width", "wall", "box"),
    [(2, 1, 1, 0, 0), (3, 1, 30, 1, 3), (3, 9, 1, 0, 1), (4, 3, 4, 0, 9), (3, 5, 6, -8, -7), (2, 6, 8, 2, 2)],
)
@pytest.mark.parametrize(
    "method",
    [
        Materiality(),
        MultiviewSGM(),
        PAPER,
        FISTA,
        evolve(FISTA, fineness=3, binarization="ray"),
        Materiality(fineness=3),
    ],
)
def test_any_size_is_answered_within_the_range(method, n, height, width, wall, box):
    for margin in (0, 1):
        scene = box_before_wall(n, height, width, wall, box, margin=margin)
        found = method.solve(scene, Context(threads=2)).disparity[1]
        assert found.shape == (height, width)
        answered = found[~np.isnan(found)]
        by_volume = isinstance(method, MultiviewSGM) or method.solver.binarization == "volume"
        assert answered.size == found.size or not by_volume
        assert (answered >= scene.disparities.least - 1e-4).all()
        assert (answered <= scene.disparities.largest + 1e-4).all()


@pytest.mark.parametrize("method", [Materiality(passes=3), MultiviewSGM(), PAPER, FISTA])
@pytest.mark.parametrize("level", [0, 255])
def test_constant_images_are_answered_without_a_warning(method, level):
    views = np.full((3, 8, 12, 3), level, np.uint8)
    scene = Scene("constant", views, ("0", "1", "2"), 1, Range(0, 3), {}, 1.0)
    estimate = method.solve(scene, Context())
    assert not np.isinf(estimate.disparity[1]).any()
    if estimate.volume is not None:
        assert np.isfinite(estimate.volume.values).all()


@pytest.mark.parametrize("start", ["mean", "soft", "consensus"])
@pytest.mark.parametrize("method", [Materiality(), FISTA], ids=["fixed_point", "fista"])
def test_views_without_any_likeness_are_answered_without_a_warning(method, start):
    views = np.zeros((3, 8, 12, 3), np.uint8)
    views[1] = 255
    scene = Scene("black and white", views, ("0", "1", "2"), 1, Range(0, 3), {}, 1.0)
    method = evolve(method, start=start, similarity="linear", **({"sharpness": 200.0} if start == "soft" else {}))
    estimate = method.solve(scene, Context())
    assert np.isfinite(estimate.disparity[1]).all()
    values = estimate.volume.values
    assert 0 <= values.min() <= values.max() <= 1


def test_a_choice_of_views_answers_in_steps_of_the_given_scene():
    scene = box_before_wall(n=5, ref=2, wall=1, box=3, margin=0)
    estimate = Materiality(views=3).solve(scene, Context())
    assert estimate.volume.views == (0, 2, 4)
    for method in (Materiality(views=3), MultiviewSGM(views=3)):
        assert wrong(method, scene) < 8


def test_paper_preset_is_literal():
    matching, solver, energy = PAPER.matching, PAPER.solver, PAPER.energy
    assert (matching.views, matching.pairs, matching.fineness, matching.truncation) == (4, "consecutive", 1, 0)
    assert (matching.similarity, matching.window, matching.sigma) == ("ssd", 5, 16)
    assert (solver.start, solver.optimiser, solver.binarization) == ("mean", "gradient", "plane")
    assert (energy.counted, energy.across, energy.along) == ("global", 0, 0)
    found = PAPER.solve(box_before_wall(), Context()).disparity[1]
    answered = found[~np.isnan(found)]
    assert answered.size > found.size / 2
    np.testing.assert_array_equal(answered, np.rint(answered))


def test_without_passes_the_map_is_the_controls():
    scene = box_before_wall()
    same = [method.solve(scene, Context()).disparity[1] for method in (Materiality(passes=0), MultiviewSGM())]
    np.testing.assert_array_equal(*same)
