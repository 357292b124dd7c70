"""Maps of all views: each is read with its own cost, and all are mended together."""

import numpy as np
import pytest

from matbench.algorithms.fusion import Fusion, seen_from
from matbench.algorithms.mending import mend
from matbench.algorithms.readings import Readings
from matbench.algorithms.similarity import Matcher, Matching
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
def test_every_view_is_read_by_the_cost_on_its_own_rays(fineness, pair_steps, rounds):
    matcher = moving_plane(fineness=fineness, pair_steps=pair_steps, noise=80, window=3)
    reader, scene = Readings(mending=rounds, large_step=0.5), matcher.scene
    first = [reader.read(Fusion().first_cost(seen_from(matcher, view)), scene.views[view]) for view in range(scene.n)]
    expected = mended(matcher, np.stack(first), rounds)
    for threads in (1, 2):
        maps = reader.first(matcher, threads)
        np.testing.assert_allclose(maps, expected, atol=1e-5)
        assert maps.dtype == np.float32

    second, energies = [], []
    for view in range(scene.n):
        cost, mu = Fusion().seen_cost(seen_from(matcher, view), maps)
        cost += np.float32(0.4) * (1 - mu)
        second.append(reader.read(cost, scene.views[view]))
        energies.append([reader.energy(cost, scene.views[view], planes) for planes in (maps[view], second[-1])])
    expected = mended(matcher, np.stack(second), rounds)
    for threads in (1, 2):
        again, *told = reader.again(matcher, maps, 0.4, threads)
        np.testing.assert_allclose(again, expected, atol=1e-5)
        np.testing.assert_allclose(told, np.mean(energies, axis=0), rtol=1e-5)


@pytest.mark.parametrize("disparity", [-1, 0, 1, 2])
def test_a_plane_is_found_in_every_view(disparity):
    matcher = moving_plane(disparity=disparity, least=-2)
    maps = Readings().first(matcher)
    again, *_ = Readings().again(matcher, maps, 0.25)
    for planes in (maps, again):
        assert (np.abs(matcher.disparity(planes) - disparity) < 0.5).mean() > 0.97


def test_maps_that_are_given_stay_as_they_are():
    matcher = moving_plane()
    maps = Readings().first(matcher)
    before = maps.copy()
    Readings().again(matcher, maps, 0.25)
    np.testing.assert_array_equal(maps, before)


def test_a_wrong_value_names_the_parameter():
    with pytest.raises(ValueError, match="mending"):
        Readings(mending=-1)
