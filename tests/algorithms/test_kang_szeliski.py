"""Selection of views, visibility and the cut, on scenes with much that is hidden."""

from functools import cache
from itertools import pairwise

import numpy as np
from attrs import evolve

from matbench import load_scene
from matbench.algorithm import Context, Estimate
from matbench.algorithms.kang_szeliski import KangSzeliski
from matbench.algorithms.sweep import Costs, Sweep
from matbench.parameters import silent_in
from matbench.scene import Range, Scene


@cache
def layers() -> Scene:
    """Some rows of a scene with five layers."""
    scene, rows = load_scene("synthetic/layers"), slice(60, 100)
    truth = {view: known[rows] for view, known in scene.truth.items()}
    regions = {name: mask[rows] for name, mask in scene.regions.items()}
    return evolve(scene, views=scene.views[:, rows], truth=truth, regions=regions, visible={})


@cache
def solved(selection: str, visibility: int, threads: int = 1) -> Estimate:
    return KangSzeliski(selection=selection, visibility=visibility).solve(layers(), Context(threads=threads))


def wrong(estimate: Estimate) -> float:
    scene = layers()
    error = np.abs(estimate.disparity[scene.ref] - scene.truth[scene.ref]) * scene.pair_steps
    return float((error > 1)[scene.regions["all"]].mean())


def test_selection_gains_much_and_visibility_little_once_it_is_on() -> None:
    """The finding of Kang, Szeliski & Chai 2001."""
    mean, seen, half, both = (wrong(solved(*kind)) for kind in (("mean", 0), ("mean", 1), ("half", 0), ("half", 1)))
    assert half < 0.7 * mean
    assert seen < 0.8 * mean
    assert abs(both - half) < 0.5 * (mean - seen)


def test_the_energy_never_rises_within_a_pass() -> None:
    estimate = solved("half", 0)
    energies = estimate.history["energy"]
    assert len(energies) >= 2
    assert all(after <= before for before, after in pairwise(energies))
    assert energies[-1] < energies[0]
    assert min(estimate.work.values()) > 0


def test_work_counts_every_pass() -> None:
    assert solved("half", 1).work["pixel_differences"] == 2 * solved("half", 0).work["pixel_differences"]
    assert solved("half", 1).work["expansions"] > solved("half", 0).work["expansions"]


def test_threads_and_seeds_change_nothing() -> None:
    once, twice = solved("half", 1), solved("half", 1, threads=2)
    seeded = KangSzeliski(visibility=1).solve(layers(), Context(seed=7))
    for other in (twice, seeded):
        np.testing.assert_array_equal(once.disparity[layers().ref], other.disparity[layers().ref])
        assert once.history == other.history


def test_views_that_do_not_see_a_point_do_not_count() -> None:
    """Of two views, one is hidden behind a plane; the point costs what the other says."""
    views = np.random.default_rng(0).integers(0, 256, (3, 4, 12, 3), np.uint8)
    sweep = Sweep.of(Scene("noise", views, tuple("012"), 1, Range(0, 3), {}, 1), Costs(selection="mean"))
    nearest = np.full((3, 4, 12), -1, np.int32)
    free = sweep.cost()
    np.testing.assert_array_equal(sweep.cost(nearest=nearest), free)
    nearest[2] = 3
    hidden = sweep.cost(nearest=nearest)
    np.testing.assert_array_equal(hidden[:, :, 2:], free[:, :, 2:])  # at most a plane behind
    left = np.stack([sweep.difference(0, plane) for plane in range(2)], axis=2)
    np.testing.assert_array_equal(hidden[:, :9, :2], left[:, :9])
    assert not np.array_equal(hidden[:, :, 0], free[:, :, 0])


def test_shared_costs_are_not_taken_anew() -> None:
    once, again = (KangSzeliski(similarity="shared", visibility=passes).solve(layers(), Context()) for passes in (0, 1))
    assert once.work == again.work
    np.testing.assert_array_equal(once.disparity[layers().ref], again.disparity[layers().ref])


def test_what_the_other_views_see_of_a_map() -> None:
    scene = Scene("flat", np.zeros((2, 1, 6, 3), np.uint8), tuple("01"), 0, Range(0, 2), {}, 1)
    planes = np.array([[0, 0, 0, 2, 0, 0]], np.int32)
    seen = Sweep.of(scene, Costs()).seen_from(planes)
    np.testing.assert_array_equal(seen[0], planes)
    np.testing.assert_array_equal(seen[1], [[0, 2, 0, -1, 0, 0]])


def test_what_is_not_read_is_said() -> None:
    assert not silent_in(KangSzeliski())
    assert set(silent_in(KangSzeliski(similarity="shared"))) == {
        "difference",
        "truncation",
        "selection",
        "visibility",
    }
