"""The fixed point of visibility and the maps of all views, on computed scenes."""

from functools import cache

import numpy as np
import pytest
from attrs import evolve

from matbench.algorithm import Context, Probe
from matbench.algorithms.inference import Inference
from matbench.algorithms.materiality import Materiality
from matbench.algorithms.materiality.consensus import consensus
from matbench.algorithms.multiview_sgm import MultiviewSGM
from matbench.algorithms.similarity import Matcher
from matbench.datasets.synthetic import SYNTHETIC
from matbench.space import visibility


@cache
def box(size="64x48", **options):
    return SYNTHETIC.load("box", {"size": size, **options}, None)


@cache
def solved(method):
    return method.solve(box(noise="6", ref="1"), Context())


def wrong(method, scene, where, bound):
    """Share of the pixels of a mask that are off by more than so many pixels of the field's pair, in per cent."""
    found = method.solve(scene, Context(volume=False)).disparity[scene.ref]
    off = np.abs(found - scene.truth[scene.ref])[scene.regions[where]] * scene.pair_steps
    return 100 * float(np.mean(~(off <= bound)))


@pytest.mark.parametrize(("surfaces", "share"), [(False, 0.8), (True, 0.9)])
@pytest.mark.parametrize("options", [{"ref": "0"}, {"n": "9"}, {"noise": "8"}], ids=str)
def test_materiality_beats_its_control_where_the_partner_sees_nothing(options, surfaces, share):
    scene = box("120x90", **options)
    inference = Inference(surfaces=surfaces)
    own, control = Materiality(inference=inference), MultiviewSGM(inference=inference)
    assert scene.regions["occ"].sum() > 250
    assert wrong(own, scene, "occ", 0.5) < share * wrong(control, scene, "occ", 0.5)
    assert wrong(own, scene, "all", 0.5) < 0.8 * wrong(control, scene, "all", 0.5)


def test_estimate_is_complete():
    scene = box(n="9")
    method = Materiality(views=5, passes=2)
    estimate = method.solve(scene, Context())
    found = estimate.disparity[scene.ref]
    assert (found.dtype, found.shape) == (np.float32, (scene.height, scene.width))
    assert estimate.volume.values.dtype == np.float32
    assert estimate.volume.views == (0, 2, 4, 6, 8)
    assert estimate.work["passes"] == len(estimate.history["changed"]) == 2
    assert all(0 <= share <= 1 for share in estimate.history["changed"])


@pytest.mark.parametrize("passes", [0, 2])
def test_a_pass_infers_all_maps_by_what_the_last_ones_say(passes):
    scene = box(ref="1")
    method = Materiality(passes=passes)
    estimate = method.solve(scene, Context())
    matcher, inference = Matcher.of(scene, method.matching), Inference()
    history = {"changed": [], "energy_before": [], "energy": []}
    maps = inference.initial_maps(matcher)
    for _ in range(passes):
        found, before, after = inference.refined_maps(matcher, maps, method.solver.material)
        for name, value in zip(history, (np.mean(np.abs(found - maps) > 0.5), before, after), strict=True):
            history[name].append(value)
        maps = found
    np.testing.assert_array_equal(estimate.disparity[1], matcher.disparity(maps[1]))
    np.testing.assert_array_equal(estimate.volume.values, consensus(matcher.space, maps))
    assert estimate.history == history


@pytest.mark.parametrize("noise", ["0", "6"])
@pytest.mark.parametrize("name", ["box", "thin", "fence", "weak", "highlight"])
def test_a_pass_lowers_the_energy_of_its_costs(name, noise):
    scene = SYNTHETIC.load(name, {"size": "96x64", "noise": noise}, None)
    for surfaces in (False, True):
        history = Materiality(passes=3, surfaces=surfaces).solve(scene, Context(volume=False)).history
        before, after = np.array(history["energy_before"]), np.array(history["energy"])
        # without noise mended maps may be as good as those of least energy
        assert surfaces or noise == "0" or after[0] < before[0]
        assert (after <= 1.03 * before).all(), "as the docstring says"


def test_visibilities_open_before_the_map_and_close_behind_it():
    scene = box("96x72")
    estimate = Materiality().solve(scene, Context())
    space, values = estimate.volume.space, estimate.volume.values
    assert 0 <= values.min() <= values.max() <= 1
    for view in range(scene.n):
        seen = space.in_view(visibility(estimate.volume, view), view)
        ends = space.in_view(values, view) * seen
        assert ends.sum(axis=1).max() <= 1 + 1e-5
        surface = scene.truth[view][:, None] * space.fineness - space.first
        plane = np.arange(space.planes)[:, None]
        before, behind = (plane > surface + 1.5), (plane < surface - 2.5)
        assert np.mean(seen[before]) > 0.8
        assert np.mean(seen[behind]) < 0.25
        nearest = np.argmax(ends, axis=1)
        assert np.mean(np.abs(nearest - surface[:, 0]) <= 1) > 0.95


def test_without_a_volume_the_map_is_the_same():
    scene = box()
    for binarization, kept in (("volume", False), ("ray", True), ("plane", True)):
        method = Materiality(binarization=binarization)
        one, other = (method.solve(scene, Context(volume=wanted)) for wanted in (True, False))
        np.testing.assert_array_equal(one.disparity[scene.ref], other.disparity[scene.ref])
        assert one.history == other.history
        assert one.work == other.work
        assert one.volume is not None
        assert (other.volume is not None) == kept


def test_it_stops_when_few_pixels_change():
    scene = box()
    shares = Materiality(passes=4, surfaces=False).solve(scene, Context()).history["changed"]
    assert shares[0] > shares[1] > 0
    between = (shares[0] + shares[1]) / 2
    stopped = Materiality(passes=4, surfaces=False, tolerance=between).solve(scene, Context())
    assert stopped.history["changed"] == shares[:2]
    assert stopped.work["passes"] == 2
    two = Materiality(passes=2, surfaces=False).solve(scene, Context())
    np.testing.assert_array_equal(stopped.disparity[scene.ref], two.disparity[scene.ref])
    at_once = Materiality(passes=4, surfaces=False, tolerance=shares[0]).solve(scene, Context()).history["changed"]
    assert at_once == shares[:2], "less than this share, not as much"


@pytest.mark.parametrize(
    "change",
    [
        {"views": 3},
        {"fineness": 1},
        {"pairs": "all"},
        {"pairs": "consecutive"},
        {"similarity": "ssd"},
        {"similarity": "rms"},
        {"similarity": "linear"},
        {"similarity": "census"},
        {"window": 5},
        {"truncation": 10.0},
        {"sigma": 20.0},
        {"colour": False},
        {"alike": 0.0},
        {"adaptive": 0.0},
        {"adaptive": 20.0},
        {"hidden": 0.1},
        {"mending": 0},
        {"material": 1.0},
        {"material": 0.0},
        {"start": "mean"},
        {"start": "soft"},
        {"sharpness": 5.0},
        {"passes": 0},
        {"passes": 2},
        {"tolerance": 0.9},
        {"binarization": "plane"},
        {"binarization": "ray"},
        {"small_step": 2.0},
        {"large_step": 0.6},
        {"contrast": 2.0},
    ],
    ids=str,
)
def test_every_switch_changes_something(change):
    base = Materiality()
    if "sigma" in change:
        base = evolve(base, similarity="rms")
    if "sharpness" in change:
        base = evolve(base, start="soft")
    if "tolerance" in change:
        base = evolve(base, passes=3)
    one, other = solved(base), solved(evolve(base, **change))
    assert not np.array_equal(one.disparity[1], other.disparity[1], equal_nan=True)
    if "binarization" in change:
        np.testing.assert_array_equal(one.volume.values, other.volume.values)
    elif one.volume.values.shape == other.volume.values.shape:
        assert not np.array_equal(one.volume.values, other.volume.values)


def test_confidence_is_by_materiality_by_costs_or_their_product():
    found = {name: solved(Materiality(confidence=name)) for name in ("materiality", "costs", "both")}
    sure = {name: estimate.confidence[1] for name, estimate in found.items()}
    maps = [estimate.disparity[1] for estimate in found.values()]
    assert all(np.array_equal(maps[0], other) for other in maps[1:]), "it changes no answer"
    np.testing.assert_allclose(sure["both"], sure["materiality"] * sure["costs"], rtol=1e-6)
    assert not np.array_equal(sure["materiality"], sure["costs"])


class Listener(Probe):
    active = True

    def __init__(self):
        self.volumes, self.iterations = {}, []

    def volume(self, name, volume):
        self.volumes[name] = volume

    def iteration(self, step, energies, volume=None, derivative=None, disparity=None):
        assert derivative is None
        self.iterations.append((step, energies, volume.values.copy(), disparity))


def test_probe_is_told_every_pass_and_changes_nothing():
    scene, listener = box(n="5", ref="2"), Listener()
    method = Materiality(views=3, passes=2)
    silent = method.solve(scene, Context(volume=False))
    told = method.solve(scene, Context(probe=listener))
    np.testing.assert_array_equal(silent.disparity[2], told.disparity[2])
    assert silent.history == told.history
    assert set(listener.volumes) == {"similarity/0-2", "similarity/2-4"}
    assert [step for step, *_ in listener.iterations] == [0, 1]
    for name, values in told.history.items():
        assert [energies[name] for _, energies, *_ in listener.iterations] == values
    np.testing.assert_array_equal(listener.iterations[-1][2], told.volume.values)
    np.testing.assert_array_equal(listener.iterations[-1][3], told.disparity[2])
    assert (listener.iterations[0][3] != told.disparity[2]).any()
