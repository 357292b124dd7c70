"""Votes of views and neighbours against plain counting, and maps that are mended."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.mending import COLOUR, DISTANCE, REACH, TRUST, classify, count_votes, mend, vote

SHAPES = st.tuples(st.integers(2, 6), st.integers(1, 5), st.integers(1, 12))


def random_maps(shape, seed, holes=0.2):
    rng = np.random.default_rng(seed)
    maps = np.round(rng.uniform(-2, 3, shape) * 8) / 8 + 1 / 64  # no point is halfway between pixels
    maps[rng.random(shape) < holes] = np.nan
    return maps.astype(np.float32), rng.integers(0, 40, (*shape, 3), dtype=np.uint8)


def counted(maps, view, tolerance):
    """Views that have the same disparity where they should see a pixel's point, and those that see through it."""
    agreeing, contradicting = np.zeros((2, *maps.shape[1:]), int)
    for y, x in np.ndindex(maps.shape[1:]):
        here = float(maps[view, y, x])
        for j in range(len(maps)):
            if j == view or np.isnan(here):
                continue
            at = round(x - (j - view) * here)
            if 0 <= at < maps.shape[2]:
                agreeing[y, x] += abs(maps[j, y, at] - here) <= tolerance
                contradicting[y, x] += maps[j, y, at] < here - tolerance
    return agreeing, contradicting


def voted(found, image, asked, trusted, step):
    """The class that half of the votes of the trusted neighbours reach, if farther off than a class.

    Also where the votes are even but for rounding, so that either class is right.
    """
    out, even = found.astype(float), np.zeros(found.shape, bool)
    least = np.nanmin(found)
    for y, x in zip(*np.nonzero(asked), strict=True):
        rows, columns = (slice(max(0, at - REACH), at + REACH + 1) for at in (y, x))
        ys, xs = np.nonzero(trusted[rows, columns])
        if ys.size == 0:
            continue
        ys, xs = ys + rows.start, xs + columns.start
        gap = np.abs(image[ys, xs].astype(float) - image[y, x]).max(axis=1)
        weight = np.exp(-gap / COLOUR - (np.abs(ys - y) + np.abs(xs - x)) / DISTANCE)
        classes = ((found[ys, xs] - least) / step).astype(int)
        votes = np.bincount(classes, weight)
        passed = np.cumsum(votes) / votes.sum()
        even[y, x] = (np.abs(passed - 0.5) < 1e-5).any()
        median = np.argmax(passed >= 0.5)
        answer = min(least + (median + 0.5) * step, np.nanmax(found))
        if not abs(found[y, x] - answer) <= step:
            out[y, x] = answer
    return out, even


def mended(maps, images, pixel, rounds):
    """The rounds one by one, in float64."""
    for number in range(rounds):
        new = []
        for view, image in enumerate(images):
            agreeing, contradicting = counted(maps, view, pixel)
            found = np.where((number == 0) & (contradicting > agreeing), np.nan, maps[view])
            trusted = (contradicting * TRUST <= agreeing) & ~np.isnan(found)
            new.append(voted(found, image, ~trusted, trusted, pixel / 2)[0] if trusted.any() else maps[view])
        maps = np.stack([fill_from_background(found) for found in new])
    return maps


@settings(max_examples=25, deadline=None)
@given(SHAPES, st.sampled_from([0.0, 0.3, 1.0]), st.integers(0, 999))
def test_votes_of_views_are_counted(shape, tolerance, seed):
    maps, _ = random_maps(shape, seed)
    for view in range(shape[0]):
        agreeing, contradicting = np.full((2, *shape[1:]), -1, np.int32)
        middle = shape[1] // 2
        for top, end in ((0, middle), (middle, shape[1])):
            count_votes(maps, view, np.float32(tolerance), top, end, agreeing, contradicting)
        expected = counted(maps, view, tolerance)
        np.testing.assert_array_equal(agreeing, expected[0])
        np.testing.assert_array_equal(contradicting, expected[1])


@settings(max_examples=20, deadline=None)
@given(SHAPES, st.sampled_from([0.25, 0.5, 1.0]), st.sampled_from([0.05, 0.5, 0.9]), st.integers(0, 999))
def test_vote_is_a_weighted_median(shape, step, share, seed):
    maps, images = random_maps(shape, seed)
    found, rng = maps[0], np.random.default_rng(seed)
    trusted = (rng.random(found.shape) < share) & ~np.isnan(found)
    asked = rng.random(found.shape) < 0.7
    if not trusted.any():
        return
    colour = np.exp(-np.arange(256) / COLOUR).astype(np.float32)
    distance = np.exp(-np.arange(REACH + 1) / DISTANCE).astype(np.float32)
    out = np.full(found.shape, 9, np.float32)
    for top, end in ((0, 1), (1, len(found))):
        least = np.float32(np.nanmin(found))
        places = np.full(found.shape, 99, np.int32)
        classify(found, trusted, least, np.float32(step), 0, top, places)
        classify(found, trusted, least, np.float32(step), top, len(found), places)
        vote(
            found, images[0], asked, places, colour, distance, least, np.nanmax(found), np.float32(step), top, end, out
        )
    expected, even = voted(found, images[0], asked, trusted, step)
    np.testing.assert_allclose(out[~even], expected[~even], atol=1e-5)


@pytest.mark.parametrize("rounds", [1, 2, 4])
@pytest.mark.parametrize("seed", [0, 1])
def test_mending_is_its_twin(rounds, seed):
    maps, images = random_maps((4, 20, 14), seed)
    found = mend(maps, images, 0.5, rounds)
    np.testing.assert_allclose(found, mended(maps, images, 0.5, rounds), atol=1e-5)
    assert (found != mend(maps, images, 0.5, rounds - 1)).any()


@settings(max_examples=25, deadline=None)
@given(SHAPES, st.integers(0, 4), st.sampled_from([0.0, 0.5, 0.95]), st.integers(0, 999))
def test_every_pixel_is_answered_within_what_was_found(shape, rounds, holes, seed):
    maps, images = random_maps(shape, seed, holes)
    before = maps.copy()
    one, two = (mend(maps, images, 0.5, rounds, threads) for threads in (1, 2))
    np.testing.assert_array_equal(maps, before)
    np.testing.assert_array_equal(one, two)
    assert one.dtype == np.float32
    for mended, given_map in zip(one, maps, strict=True):
        if np.isnan(given_map).all():
            assert np.isnan(mended).all()
            continue
        assert not np.isnan(mended).any()
        assert mended.min() >= np.nanmin(given_map)
        assert mended.max() <= np.nanmax(given_map)


def test_no_rounds_only_fill_holes():
    maps, images = random_maps((3, 6, 9), 0)
    np.testing.assert_array_equal(mend(maps, images, 0.5, 0), np.stack([fill_from_background(found) for found in maps]))


def strip_before_wall(n=5, height=8, width=48, wall=1.0, strip=4.0):
    """Exact maps of a strip before a wall, as pictures of two plain colours."""
    columns = np.arange(width)
    maps = np.empty((n, height, width), np.float32)
    for j in range(n):
        inside = columns + (j - n // 2) * strip
        maps[j] = np.where((inside >= 18) & (inside < 30), strip, wall)
    images = np.where(maps[..., None] == strip, np.uint8(200), np.uint8(60)) * np.ones(3, np.uint8)
    return maps, images


@pytest.mark.parametrize(("wall", "strip"), [(1.0, 4.0), (-3.0, 0.0)])
def test_exact_maps_stay_as_they_are(wall, strip):
    maps, images = strip_before_wall(wall=wall, strip=strip)
    np.testing.assert_array_equal(mend(maps, images, 0.5, 3), maps)


@pytest.mark.parametrize("view", [0, 2, 4])
def test_what_other_views_see_through_is_taken_from_its_own_surface(view):
    maps, images = strip_before_wall()
    fat = maps.copy()
    # three pixels of the wall on either side are taken for the strip
    inside = np.flatnonzero(maps[view, 0] == 4)
    fat[view, :, inside[0] - 3 : inside[-1] + 4] = 4
    assert (np.abs(fat[view] - maps[view]) > 0.5).sum() == 6 * 8
    mended = mend(fat, images, 0.5, 3)
    assert (np.abs(mended - maps) <= 0.5).all()
    np.testing.assert_array_equal(mended[np.arange(5) != view], maps[np.arange(5) != view])


def test_a_hole_takes_the_surface_of_its_colour():
    maps, images = strip_before_wall()
    torn = maps.copy()
    torn[2, 3:5, 18:22] = np.nan  # the strip's left side; the background would be the wall
    assert (fill_from_background(torn[2])[3, 18:22] == 1).all()
    mended = mend(torn, images, 0.5, 1)
    assert (np.abs(mended[2] - maps[2]) <= 0.5).all()


@pytest.mark.parametrize(("agreeing", "stays"), [(TRUST, True), (TRUST - 1, False)])
def test_several_must_agree_for_one_that_contradicts(agreeing, stays):
    # a point that all views see but the first, which sees the wall behind it
    maps = np.zeros((agreeing + 2, 5, 40), np.float32)
    last = agreeing + 1
    for j in range(1, last + 1):
        maps[j, 2, 20 + last - j] = 1
    mended = mend(maps, np.zeros((*maps.shape, 3), np.uint8), 0.3, 1)
    assert (mended[last, 2, 20] == 1) == stays


def test_a_view_that_all_others_contradict_keeps_its_answers():
    maps = np.ones((3, 2, 24), np.float32)
    maps[1] = 3
    maps[1, 0, 5] = np.nan
    mended = mend(maps, np.zeros((3, 2, 24, 3), np.uint8), 0.5, 2)
    np.testing.assert_array_equal(mended[1], 3)
