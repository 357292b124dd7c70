"""Matches of all views rated together, and that no view sees through another's surface."""

from itertools import pairwise

import numpy as np
import pytest
from attrs import evolve
from boxes import box_before_wall
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.cuts.interactions import UNKNOWN, Interactions
from matbench.algorithms.cuts.lattice import whole_shifts
from matbench.algorithms.niquin import Niquin, rate_matches
from matbench.algorithms.sampling import search_space
from matbench.algorithms.similarity import pairs as view_pairs


def shifts_of(space):
    """(views, views, planes) columns from a pixel to its homologue."""
    out = np.zeros((space.views, space.views, space.planes), np.int64)
    every = view_pairs(space.views, "all")
    for (i, j), shift in zip(every, whole_shifts(space, every), strict=True):
        out[i, j], out[j, i] = shift, -shift
    return out


def twin(labels, differences, shifts, hidden, limit, y, i, k, x):
    """What a pixel costs in a plane, from the list of the views that see it."""
    views, width = labels.shape[1:]
    nearest = max(k, labels[y, i, x]) + 1
    places = {j: x + shifts[i, j, k] for j in range(views)}
    seeing = {j: at for j, at in places.items() if 0 <= at < width and labels[y, j, at] <= nearest}
    lefts = [
        (j, seeing[j] if j >= i else seeing[j + 1] - shifts[j, j + 1, k])  # by the pixel nearer to view i
        for j in seeing
        if j + 1 in seeing
    ]
    pairs = [int(differences[j, y, k, left]) for j, left in lefts if 0 <= left < width]
    known = [min(value, limit) for value in pairs if value != UNKNOWN]
    return hidden * (views - len(seeing)) + (sum(known) // len(known) if known else 0)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 999), st.integers(2, 4), st.integers(-2, 1), st.integers(1, 2))
def test_a_match_is_rated_by_the_views_that_see_it(seed, views, first, fineness):
    rng = np.random.default_rng(seed)
    scene = box_before_wall(n=views, height=2, width=7)
    space = search_space(scene, fineness)
    shape = 2, space.planes, space.width
    labels = rng.integers(0, space.planes, (2, views, space.width)).astype(np.int32)
    differences = rng.integers(0, 90, (views - 1, *shape)).astype(np.uint16)
    differences[rng.random(differences.shape) < 0.2] = UNKNOWN
    out = np.full((2, views, space.planes, space.width), -1, np.int32)
    rate_matches(labels, differences, shifts_of(space), 7, 60, 0, 2, out)
    for y, i, k, x in np.ndindex(out.shape):
        assert out[y, i, k, x] == twin(labels, differences, shifts_of(space), 7, 60, y, i, k, x)


def test_two_views_pay_twice_what_they_differ_by_where_they_agree():
    scene = box_before_wall(n=2, height=6, width=20, ref=0)
    space = search_space(scene, 1)
    between = Interactions.of(scene, space, view_pairs(2, "consecutive"), "published", 1, "absolute")
    labels = np.stack([np.rint(scene.truth[i]) - space.first for i in (0, 1)], axis=1).astype(np.int32)
    rated = np.empty((6, 2, space.planes, 20), np.int32)
    rate_matches(labels, between.differences, shifts_of(space), 0, UNKNOWN - 1, 0, 6, rated)
    paid = np.take_along_axis(rated, labels[:, :, None], 2).sum()
    agreeing = 0
    for y, x in np.ndindex(6, 20):
        k = labels[y, 0, x]
        at = x + between.shifts[0, k]
        if 0 <= at < 20 and labels[y, 1, at] == k:
            agreeing += int(between.differences[0, y, k, x])
    assert agreeing > 0 or paid == 0
    assert paid == 2 * agreeing


@pytest.mark.parametrize("similarity", ["published", "shared"])
def test_a_box_and_what_it_hides_are_found_in_all_views(similarity):
    scene = box_before_wall(height=20, width=50)
    estimate = Niquin(similarity=similarity).solve(scene, Context())
    assert set(estimate.disparity) == set(scene.truth)
    assert estimate.work["violations"] == 0
    wrong = [np.mean(np.abs(estimate.disparity[j] - scene.truth[j]) > 0.5) for j in scene.truth]
    assert wrong[scene.ref] < 0.06
    assert max(wrong) < 0.15


def test_a_surface_hides_neither_itself_nor_what_would_replace_it():
    scene = box_before_wall(n=3, height=1, width=24)
    space = search_space(scene, 1)
    alike = np.zeros((2, 1, space.planes, space.width), np.uint16)
    labels = np.full((1, 3, space.width), 2, np.int32)
    labels[0, :, 12:] += 1  # one plane nearer, as on a slant
    hidden = np.empty((1, 3, space.planes, space.width), np.int32)
    rate_matches(labels, alike, shifts_of(space), 1, 1, 0, 1, hidden)
    outside = np.empty_like(hidden)
    rate_matches(np.zeros_like(labels), alike, shifts_of(space), 1, 1, 0, 1, outside)
    np.testing.assert_array_equal(hidden, outside)
    labels[0, :, 12:] += 1  # a step, which hides
    rate_matches(labels, alike, shifts_of(space), 1, 1, 0, 1, hidden)
    assert (hidden > outside).any()


@pytest.mark.parametrize(("name", "passes"), [("box", 1), ("slanted", 2), ("fence", 2)])
def test_nothing_is_violated_and_the_energy_falls_from_pass_to_pass(name, passes):
    scene = load_scene(f"synthetic/{name}[size=48x36 n=3]")
    estimate = Niquin(fineness=1, rounds=3).solve(scene, Context())
    assert estimate.work["violations"] == 0
    energies = estimate.history["energy"]
    assert len(energies) == passes
    assert all(after < before for before, after in pairwise(energies))


def test_the_answer_depends_on_neither_context_nor_library():
    scene = load_scene("synthetic/box[size=48x36 n=3]")
    first = Niquin(rounds=2).solve(scene, Context())
    others = (Niquin(rounds=2), Context(seed=5, threads=3)), (Niquin(rounds=2, flow="scipy"), Context())
    for method, context in others:
        again = method.solve(scene, context)
        for view, found in first.disparity.items():
            np.testing.assert_array_equal(found, again.disparity[view])
        assert again.history == first.history
        assert again.work == first.work


def test_the_higher_the_price_of_occlusion_the_fewer_are_occluded():
    scene = load_scene("synthetic/box[size=48x36 n=3 noise=8]")
    space = search_space(scene)
    unknown = np.full((2, space.rows, space.planes, space.width), UNKNOWN, np.uint16)
    hidden = []
    for price in (0.0, 5.0):
        maps = Niquin(occlusion=price).solve(scene, Context()).disparity
        planes = [np.rint(maps[view] * space.fineness) - space.first for view in range(3)]
        labels = np.stack(planes, axis=1).astype(np.int32)
        rated = np.empty((space.rows, 3, space.planes, space.width), np.int32)
        rate_matches(labels, unknown, shifts_of(space), 1, 1, 0, space.rows, rated)
        hidden.append(np.take_along_axis(rated, labels[:, :, None], 2).sum())
    assert hidden[0] > hidden[1], hidden


@pytest.mark.parametrize("fineness", [1, 2])
def test_in_a_mirror_the_answer_is_mirrored(fineness):
    scene = load_scene("synthetic/slanted[size=48x36 n=3]")
    mirrored = evolve(scene, views=scene.views[::-1, :, ::-1].copy(), truth={}, regions={}, visible={})
    one, other = (Niquin(fineness=fineness, rounds=2).solve(seen, Context()).disparity for seen in (scene, mirrored))
    for view in range(3):
        np.testing.assert_array_equal(one[view], other[2 - view][:, ::-1])


@pytest.mark.parametrize("name", ["middlebury2001/tsukuba", "middlebury2003/teddy[size=quarter]"])
def test_nothing_is_violated_in_real_pictures(name, data_root):
    scene = load_scene(name, data=data_root)
    strip = evolve(scene, views=scene.views[:, 150:166], truth={}, regions={})
    estimate = Niquin(views=3, rounds=1).solve(strip, Context())
    assert estimate.work["violations"] == 0
    assert len(np.unique(estimate.disparity[strip.ref])) > 4
