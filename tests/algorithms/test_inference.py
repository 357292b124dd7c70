"""Maps of all views: each is inferred from costs on its own rays, and all are mended together."""

import numpy as np
import pytest

from matbench.algorithms.fusion import Fusion
from matbench.algorithms.inference import Inference
from matbench.algorithms.mending import mend
from matbench.algorithms.outlines import outlined
from matbench.algorithms.semiglobal import SemiGlobal
from matbench.algorithms.similarity import Matcher, Matching
from matbench.algorithms.surfaces import smoothed
from matbench.scene import Range, Scene


def moving_plane(n=4, height=18, width=20, disparity=1, least=-1, largest=3, pair_steps=1.0, noise=0, **settings):
    """Views of a textured plane at one disparity."""
    rng = np.random.default_rng(0)
    texture = rng.integers(0, 256, (height, width + 3 * n * abs(disparity), 3), dtype=np.uint8)
    shift = n * abs(disparity)
    views = np.stack([texture[:, shift + j * disparity :][:, :width] for j in range(n)])
    views = np.clip(views + rng.normal(0, noise, views.shape), 0, 255).astype(np.uint8)
    scene = Scene("plane", views, tuple(map(str, range(n))), 1, Range(least, largest), {}, pair_steps)
    return Matcher.of(scene, Matching(views=0, **settings))


def mended(matcher, maps, rounds):
    """Planes of the space, mended in pixels per view step within one pixel of the field's pair."""
    space = matcher.space
    steps = ((maps + space.first) / space.fineness).astype(np.float32)
    return mend(steps, matcher.scene.views, 1 / matcher.scene.pair_steps, rounds) * space.fineness - space.first


@pytest.mark.parametrize("rounds", [0, 2])
@pytest.mark.parametrize(("fineness", "pair_steps"), [(1, 1.0), (2, 1.0), (2, 3.0)])
def test_every_view_is_inferred_from_costs_on_its_own_rays(fineness, pair_steps, rounds):
    matcher = moving_plane(fineness=fineness, pair_steps=pair_steps, noise=80, window=3)
    semiglobal, scene = SemiGlobal(large_step=0.5), matcher.scene
    inference = Inference(semiglobal=semiglobal, mending=rounds, surfaces=False)
    views = [matcher.with_reference(view) for view in range(scene.n)]
    first = [
        semiglobal.infer(Fusion().first_cost(one), scene.views[view], largest=Fusion().largest())
        for view, one in enumerate(views)
    ]
    expected = mended(matcher, np.stack(first), rounds)
    for threads in (1, 2):
        maps = inference.initial_maps(matcher, threads)
        np.testing.assert_allclose(maps, expected, atol=1e-5)
        assert maps.dtype == np.float32

    second, energies, unit = [], [], semiglobal.paths(Fusion().largest(0.4)).unit
    for view, one in enumerate(views):
        cost, mu = Fusion().seen_cost(one, maps)
        cost += np.float32(0.4) * (1 - mu)
        second.append(semiglobal.infer(cost, scene.views[view], largest=Fusion().largest(0.4)))
        rounded = np.floor(cost * np.float32(unit) + np.float32(0.5)) / unit
        energies.append([semiglobal.energy(rounded, scene.views[view], planes) for planes in (maps[view], second[-1])])
    expected = mended(matcher, np.stack(second), rounds)
    for threads in (1, 2):
        again, *told = inference.refined_maps(matcher, maps, 0.4, threads)
        np.testing.assert_allclose(again, expected, atol=1e-5)
        np.testing.assert_allclose(told, np.mean(energies, axis=0), rtol=1e-5)


@pytest.mark.parametrize("disparity", [-1, 0, 1, 2])
def test_a_plane_is_found_in_every_view(disparity):
    matcher = moving_plane(disparity=disparity, least=-2)
    maps = Inference().initial_maps(matcher)
    again, *_ = Inference().refined_maps(matcher, maps, 0.25)
    for planes in (maps, again):
        assert (np.abs(matcher.disparity(planes) - disparity) < 0.5).mean() > 0.97


def test_maps_that_are_given_stay_as_they_are():
    matcher = moving_plane()
    maps = Inference().initial_maps(matcher)
    before = maps.copy()
    Inference().refined_maps(matcher, maps, 0.25)
    np.testing.assert_array_equal(maps, before)


def test_a_wrong_value_names_the_parameter():
    with pytest.raises(ValueError, match="mending"):
        Inference(mending=-1)


def test_unsure_pixels_of_the_first_maps_lie_on_the_surfaces_of_surer_ones():
    matcher = moving_plane(fineness=2, pair_steps=3.0, noise=80, window=3)
    space, scene = matcher.space, matcher.scene
    pixels = np.float32(scene.pair_steps / space.fineness)
    rough, sure = Inference(surfaces=False), np.empty((space.rows, space.width), np.float32)
    for view in range(scene.n):
        one = matcher.with_reference(view)
        image = scene.views[view]
        smooth = smoothed(rough.initial_maps(one, 1, sure)[view] * pixels, sure, image)
        expected = outlined(smooth, image) / pixels
        for threads in (1, 2):
            np.testing.assert_array_equal(Inference().initial_maps(matcher, threads)[view], expected)
