"""Maps of all views, and that none sees through another's surface."""

import numpy as np
import pytest
from attrs import evolve
from boxes import box_before_wall

from matbench import load_scene
from matbench.algorithm import Context, Probe
from matbench.algorithms.kolmogorov_zabih import KolmogorovZabih
from matbench.space import visibility


@pytest.mark.parametrize("similarity", ["published", "shared"])
@pytest.mark.parametrize("pairs", ["consecutive", "all", "reference"])
def test_a_box_and_what_it_hides_are_found_in_all_views(pairs, similarity):
    scene = box_before_wall(height=20, width=50)
    estimate = KolmogorovZabih(pairs=pairs, similarity=similarity).solve(scene, Context())
    assert set(estimate.disparity) == set(scene.truth)
    assert estimate.work["violations"] == 0
    wrong = [np.mean(np.abs(estimate.disparity[j] - scene.truth[j]) > 0.5) for j in scene.truth]
    assert wrong[scene.ref] < 0.03
    assert max(wrong) < 0.1


def test_ranges_find_a_box_too_and_are_read_beside_the_methods_own_costs_only():
    scene = box_before_wall(height=20, width=50)
    estimate = KolmogorovZabih(ranges=True).solve(scene, Context())
    assert estimate.work["violations"] == 0
    assert np.mean(np.abs(estimate.disparity[scene.ref] - scene.truth[scene.ref]) > 0.5) < 0.05
    assert "ranges" not in KolmogorovZabih(ranges=True).silent
    assert KolmogorovZabih(similarity="shared").silent["ranges"] == "similarity=published"


def test_with_ranges_and_reference_pairs_the_figures_of_a_prototype_are_reached(data_root):
    scene = load_scene("middlebury2001/tsukuba", data=data_root)
    estimate = KolmogorovZabih(pairs="reference", ranges=True, rounds=2).solve(scene, Context(volume=False))
    wrong = ~(np.abs(estimate.disparity[scene.ref] - scene.truth[scene.ref]) * scene.pair_steps <= 1)
    for region, figure in (("nonocc", 1.7), ("all", 2.4), ("occ", 29)):
        assert 100 * wrong[scene.regions[region]].mean() < figure * 1.1


@pytest.mark.parametrize("name", ["box", "slanted", "fence"])
@pytest.mark.parametrize("pairs", ["consecutive", "all"])
def test_nothing_is_violated_on_scenes_of_fine_planes(name, pairs):
    scene = load_scene(f"synthetic/{name}[size=48x36 n=3]")
    estimate = KolmogorovZabih(pairs=pairs, fineness=2, rounds=1).solve(scene, Context())
    assert estimate.work["violations"] == 0
    energies = estimate.history["energy"]
    assert list(energies) == sorted(energies, reverse=True)
    assert energies[0] > energies[-1]


def test_the_answer_depends_on_neither_context_nor_library():
    scene = load_scene("synthetic/box[size=48x36 n=3]")
    first = KolmogorovZabih().solve(scene, Context())
    for method, context in (
        (KolmogorovZabih(), Context(seed=5, threads=3)),
        (KolmogorovZabih(flow="scipy"), Context()),
    ):
        again = method.solve(scene, context)
        for view, found in first.disparity.items():
            np.testing.assert_array_equal(found, again.disparity[view])
        assert again.history == first.history
        assert again.work == first.work


def test_the_volume_is_what_the_maps_say():
    scene = load_scene("synthetic/box[size=48x36 n=3]")
    estimate = KolmogorovZabih().solve(scene, Context())
    volume, space = estimate.volume, estimate.volume.space
    for view, found in estimate.disparity.items():
        seen = space.in_view(visibility(volume, view), view)
        solid = space.in_view(volume.values, view)
        plane = np.rint(found * space.fineness).astype(int) - space.first
        assert np.take_along_axis(solid, plane[:, None], 1).all(), "each ray ends in its own plane or before it"
        behind = np.arange(space.planes)[:, None] < plane[:, None]
        assert not seen[behind].any()
    assert KolmogorovZabih().solve(scene, Context(volume=False)).volume is None


def test_views_are_chosen_and_answers_are_in_the_steps_of_the_scene():
    scene = load_scene("synthetic/box[size=48x36 n=5]")
    estimate = KolmogorovZabih(views=3).solve(scene, Context())
    assert tuple(estimate.disparity) == scene.widest(3)
    found = estimate.disparity[scene.ref]
    assert np.mean(np.abs(found - scene.truth[scene.ref]) * scene.pair_steps > 1) < 0.1


def test_a_view_without_texture_stays_far():
    scene = box_before_wall(height=8, width=20)
    flat = np.full_like(scene.views, 90)
    found = KolmogorovZabih().solve(evolve(scene, views=flat), Context())
    assert (found.disparity[scene.ref] == scene.disparities.least).all()


class Listener(Probe):
    active = True

    def __init__(self):
        self.told = []

    def iteration(self, step, energies, volume=None, derivative=None, disparity=None):
        self.told.append((step, energies["energy"], volume.values.sum(), disparity))


def test_each_round_is_told():
    scene, probe = load_scene("synthetic/box[size=48x36 n=3]"), Listener()
    estimate = KolmogorovZabih().solve(scene, Context(probe=probe))
    assert [told[:2] for told in probe.told] == list(enumerate(estimate.history["energy"][1:]))
    np.testing.assert_array_equal(probe.told[-1][3], estimate.disparity[scene.ref])
    assert probe.told[-1][2] == estimate.volume.values.sum()


@pytest.mark.parametrize("name", ["middlebury2001/tsukuba", "middlebury2003/teddy[size=quarter]"])
def test_nothing_is_violated_in_real_pictures(name, data_root):
    scene = load_scene(name, data=data_root)
    strip = evolve(scene, views=scene.views[:, 150:166], truth={}, regions={})
    estimate = KolmogorovZabih(views=3, rounds=1).solve(strip, Context())
    assert estimate.work["violations"] == 0
    assert len(np.unique(estimate.disparity[strip.ref])) > 4
