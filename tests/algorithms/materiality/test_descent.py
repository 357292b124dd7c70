"""The descent of the energy, plain and accelerated, on a computed scene."""

from functools import cache

import numpy as np
import pytest
from attrs import evolve

from matbench.algorithm import Context, Probe
from matbench.algorithms.materiality import Materiality
from matbench.algorithms.materiality.descent import RISE
from matbench.datasets.synthetic import SYNTHETIC

PAPER = Materiality(**Materiality.presets["paper"])


FISTA = Materiality(optimiser="fista", views=5, passes=5)


@cache
def box(**options):
    return SYNTHETIC.load("box", {"size": "48x36", **options}, None)


@cache
def solved(method):
    return method.solve(box(noise="6"), Context())


def test_estimate_is_complete():
    scene = box()
    estimate = FISTA.solve(scene, Context())
    assert estimate.disparity[scene.ref].dtype == np.float32
    assert estimate.disparity[scene.ref].shape == (scene.height, scene.width)
    values = estimate.volume.values
    assert values.dtype == np.float32
    assert 0 <= values.min() <= values.max() <= 1
    assert estimate.volume.views == (0, 1, 2, 3, 4)
    assert {"total", "data", "smooth", "restart"} <= set(estimate.history)
    np.testing.assert_allclose(
        estimate.history["total"], np.add(estimate.history["data"], estimate.history["smooth"]), rtol=1e-9
    )
    passes = estimate.work["passes"]
    assert passes == FISTA.solver.passes
    assert estimate.work["point_updates"] == passes * values.size
    assert estimate.work["pair_similarities"] > 0


@pytest.mark.parametrize("seed", ["0", "1"])
@pytest.mark.parametrize(
    "method",
    [evolve(FISTA, passes=60), evolve(FISTA, passes=60, across=0, along=0, pairs="all"), PAPER],
    ids=["fista", "untied", "paper"],
)
def test_energy_never_rises_between_restarts(method, seed):
    history = method.solve(box(seed=seed), Context()).history
    total, restart = np.array(history["total"]), np.array(history["restart"])
    assert len(total) > 5
    compared = restart[1:] == 0
    assert (total[1:][compared] <= total[:-1][compared] * (1 + RISE)).all()
    assert total[-1] < total[0]


def test_it_stops_when_a_pass_gains_little():
    scene, plain = box(), evolve(FISTA, optimiser="gradient", passes=30)
    total = np.array(plain.solve(scene, Context()).history["total"])
    gains = (total[:-1] - total[1:]) / total[1:]
    few = int(np.flatnonzero(gains < 0.01)[0]) + 2
    assert 2 < few < 30
    stopped = evolve(plain, tolerance=0.01).solve(scene, Context())
    assert stopped.history["total"] == total[:few].tolist()


@pytest.mark.parametrize("name", ["paper", "descent"])
def test_presets_descend(name):
    method = Materiality(**Materiality.presets[name])
    assert method.solver.optimiser in ("gradient", "fista")
    assert "total" in method.solve(box(), Context()).history


@pytest.mark.parametrize(
    "change",
    [
        {"views": 3},
        {"pairs": "all"},
        {"start": "mean"},
        {"start": "soft"},
        {"sharpness": 5.0},
        {"count": 1.0},
        {"counted": "global"},
        {"target": "union"},
        {"across": 0.0},
        {"along": 0.0},
        {"edge": 40.0},
        {"optimiser": "gradient"},
        {"optimiser": "fixed_point"},
        {"passes": 3},
        {"tolerance": 0.9},
        {"alike": 0.0},
        {"adaptive": 0.0},
        {"mending": 0},
        {"binarization": "plane"},
        {"binarization": "ray"},
        {"binarization": "maps"},
        {"form": "linear"},
        {"hidden": 0.0},
        {"material": 1.0},
        {"small_step": 2.0},
        {"large_step": 0.6},
        {"contrast": 2.0},
    ],
    ids=str,
)
def test_every_switch_changes_something(change):
    reading = {"binarization", "hidden", "material", "small_step", "large_step", "contrast"}
    # the soft start infers no maps
    base = evolve(FISTA, start="soft" if set(change) <= reading | {"start", "sharpness"} else "consensus")
    if change == {"start": "soft"}:
        base = FISTA
    one, other = solved(base), solved(evolve(base, **change))
    same_volume = np.array_equal(one.volume.values, other.volume.values)
    if set(change) <= reading:
        assert same_volume
        assert not np.array_equal(one.disparity[2], other.disparity[2], equal_nan=True)
    else:
        assert not same_volume


def test_read_as_maps_a_descent_ends_with_a_pass_of_the_fixed_point():
    scene = box(noise="6")
    idle = evolve(FISTA, passes=0, binarization="maps").solve(scene, Context())
    # nothing has descended: but for rays that are read from mu instead of the maps, it is the fixed point
    default = evolve(FISTA, optimiser="fixed_point", passes=1).solve(scene, Context())
    apart = np.abs(idle.disparity[scene.ref] - default.disparity[scene.ref]) * scene.pair_steps
    assert (apart < 0.5).mean() > 0.97
    assert idle.work["pair_similarities"] > default.work["pair_similarities"]


class Listener(Probe):
    active = True

    def __init__(self):
        self.volumes, self.iterations = {}, []

    def volume(self, name, volume):
        self.volumes[name] = volume

    def iteration(self, step, energies, volume=None, derivative=None, disparity=None):
        self.iterations.append((step, energies, volume.values.copy(), derivative.values.copy(), disparity))


@pytest.mark.parametrize("across", [10.0, 0.0])
def test_probe_is_told_everything_and_changes_nothing(across):
    scene, listener = box(n="5", ref="2"), Listener()
    method = evolve(FISTA, views=3, passes=6, across=across)
    silent = method.solve(scene, Context())
    told = method.solve(scene, Context(probe=listener))
    np.testing.assert_array_equal(silent.disparity[2], told.disparity[2])
    np.testing.assert_array_equal(silent.volume.values, told.volume.values)
    assert silent.history == told.history
    assert set(listener.volumes) == {"similarity/0-2", "similarity/2-4"}
    assert [step for step, *_ in listener.iterations] == list(range(len(told.history["total"])))
    _, energies, mu, slope, disparity = listener.iterations[0]
    assert energies["total"] == told.history["total"][0]
    assert disparity.shape == (scene.height, scene.width)
    assert mu.shape == slope.shape == told.volume.values.shape
