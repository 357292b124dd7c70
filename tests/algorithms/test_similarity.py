"""Similarities against a plain walk over target points and window taps."""

import numpy as np
import pytest
from neighbours import random_scene

from matbench.algorithms.similarity import Matcher, Matching, pairs
from matbench.scene import Range, Scene


def test_blocks_and_threads_give_the_same():
    matcher = Matcher.of(random_scene(4, 37, 9), Matching(views=4, fineness=2))
    rho = matcher.all(threads=1)
    np.testing.assert_array_equal(matcher.all(threads=2), rho)
    np.testing.assert_array_equal(matcher.block(5, 8), rho[5:8])


def test_comparisons_counts_points_in_both_frusta():
    matcher = Matcher.of(random_scene(3, 2, 5, -2, 3), Matching(views=3, pairs="all"))
    space = matcher.space
    inside = np.zeros((3, space.planes, space.columns), bool)
    for view in range(3):
        for k in range(space.planes):
            inside[view, k, space.frustum(view, k)] = True
    assert matcher.comparisons == 2 * sum((inside[i] & inside[j]).sum() for i, j in matcher.pairs)


@pytest.mark.parametrize("similarity", ["mixed", "ssd"])
@pytest.mark.parametrize("window", [1, 3])
def test_what_is_kept_for_rays_gives_the_same(similarity, window):
    matcher = Matcher.of(
        random_scene(3, 5, 9, -1, 2), Matching(views=3, fineness=2, similarity=similarity, window=window)
    )
    kept = matcher.on_rays(2).with_reference(2)
    rho = matcher.with_reference(2).rays(matcher.phases(), 0, 5)
    np.testing.assert_array_equal(kept.rays(kept.phases(), 0, 5), rho)
    assert kept.ray_comparisons == matcher.with_reference(2).ray_comparisons
    assert kept.rows.nbytes + kept.slopes.nbytes + kept.bits.nbytes + kept.masks.nbytes == 0


def test_pairs():
    assert pairs(4, "consecutive").tolist() == [[0, 1], [1, 2], [2, 3]]
    assert pairs(3, "all").tolist() == [[0, 1], [0, 2], [1, 2]]
    assert pairs(4, "reference", 2).tolist() == [[0, 2], [1, 2], [2, 3]]


@pytest.mark.parametrize("sigma", [0.5, 9.0, 300.0])
@pytest.mark.parametrize("form", ["ssd", "rms"])
def test_falloff_is_exponential_from_one_to_zero(form, sigma):
    # views that differ by 0, 1, 2, ... grey levels, one difference a row
    views = np.zeros((2, 256, 3, 3), np.uint8)
    views[1] = np.arange(256)[:, None, None]
    scene = Scene("steps", views, ("0", "1"), 0, Range(0, 0), {}, 1.0)
    rho = Matcher.of(scene, Matching(similarity=form, window=1, sigma=sigma, truncation=0.0)).all()[:, 0, 0, 1]
    levels = np.arange(256) / sigma
    expected = 255 * np.exp(-(levels**2) if form == "ssd" else -levels)
    assert np.abs(rho - expected).max() <= 0.5 + 5e-3
    assert (rho[0], (np.diff(rho.astype(int)) <= 0).all()) == (255, True)


@pytest.mark.parametrize(
    "change",
    [
        {"similarity": "rms"},
        {"similarity": "linear"},
        {"similarity": "census"},
        {"similarity": "mixed"},
        {"colour": False},
        {"window": 5},
        {"window": 1},
        {"truncation": 20.0},
        {"sigma": 30.0},
        {"similarity": "mixed", "alike": 0.0},
        {"similarity": "census", "alike": 0.0},
    ],
    ids=str,
)
def test_every_switch_changes_the_similarity(change):
    base = {"similarity": "ssd", "sigma": 60.0, "truncation": 0.0}
    if "alike" in change:
        base |= {"similarity": change["similarity"], "truncation": 20.0}
    scene = random_scene()
    one, other = (Matcher.of(scene, Matching(**settings)).all() for settings in (base, base | change))
    assert (one != other).mean() > 0.1


def test_a_masked_census_does_not_see_what_moves_behind_an_edge():
    # a smooth strip before a background that differs between the views
    views = np.random.default_rng(0).integers(160, 256, (2, 12, 24, 3), dtype=np.uint8)
    views[:, :, 8:16] = np.random.default_rng(1).integers(40, 46, (12, 8, 3))
    scene = Scene("strip", views, ("0", "1"), 0, Range(0, 0), {}, 1.0)
    masked, whole = (
        Matcher.of(scene, Matching(similarity="census", window=1, alike=most)).all()[:, 0, 0] for most in (10.0, 0.0)
    )
    assert (masked[:, 9:15] == 255).all()
    assert (whole[:, [9, 10, 13, 14]] < 255).mean() < 1
    assert masked[:, :7].mean() < 200


def test_census_is_blind_to_brightness_and_contrast():
    scene = random_scene(2, 8, 12, 0, 0)
    even = np.stack([scene.views[0] // 2 * 2, scene.views[0] // 2])
    assert Matcher.of(scene, Matching(similarity="census")).all().min() < 128
    # halved even numbers keep their order
    twins = Scene("twins", even, ("0", "1"), 0, Range(0, 0), {}, 1.0)
    assert (Matcher.of(twins, Matching(similarity="census")).all() == 255).all()


def test_fewer_views_rescale_the_answer():
    scene = random_scene(5, 3, 8, 0, 2, pair_steps=2.0)
    matcher = Matcher.of(scene, Matching(views=3))
    assert matcher.indices == (0, 2, 4)
    assert matcher.step == 2
    # plane k / q is in pixels per two view steps
    found = matcher.disparity(np.array([[2.0]], np.float32))
    assert found[0, 0] == pytest.approx(matcher.space.disparities[2] / 2)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("views", 1),
        ("fineness", -1),
        ("texture", -1.0),
        ("texture", 1e38),
        ("texture", float("inf")),
        ("texture", float("nan")),
        ("pairs", "some"),
        ("similarity", "ncc"),
        ("window", 4),
        ("sigma", 0.0),
        ("truncation", -1.0),
        ("alike", -1.0),
    ],
)
def test_a_wrong_value_names_the_parameter(name, value):
    with pytest.raises(ValueError, match=name):
        Matching(**{name: value})
