"""Similarities against a plain walk over target points and window taps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.features import same_surface
from matbench.algorithms.sampling import fine_rows
from matbench.algorithms.similarity import Matcher, Matching, pairs
from matbench.scene import Range, Scene


def random_scene(n=3, height=4, width=6, least=-1.0, largest=2.0, seed=0, pair_steps=1.0):
    views = np.random.default_rng(seed).integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    labels = tuple(map(str, range(n)))
    return Scene("random", views, labels, n // 2, Range(least, largest), {}, pair_steps)


def slope(row, sample, q):
    """Half the difference of the samples one pixel to either side, those beyond an edge taken from it."""
    return (row[min(sample + q, row.size - 1)] - row[max(sample - q, 0)]) / 2


def around(values, y, sample, q):
    """(..., 7, 7) the pixels around, those beyond an edge taken from it."""
    height, samples = values.shape[-2:]
    near = np.arange(-3, 4)
    return values[..., np.clip(y + near, 0, height - 1), :][..., np.clip(sample + q * near, 0, samples - 1)]


def darker(grey, y, sample, q):
    """Which of the 7x7 pixels around are darker."""
    return around(grey, y, sample, q) < grey[y, sample]


def like_middle(rows, y, sample, q, most):
    """Which of the 7x7 pixels are next to the middle, or within `most` grey levels of it in every channel."""
    like = (np.abs(around(rows, y, sample, q) - rows[:, y, sample, None, None]) <= most).all(axis=0)
    like[2:5, 2:5] = True
    like[3, 3] = False
    return like


def differing(order, like):
    """h: how many of the 48 pixels are darker in one view only, scaled up from those alike in both."""
    if like is None:
        return np.sum(order[0] != order[1])
    both = like[0] & like[1]
    return 48 * np.sum((order[0] != order[1]) & both) / both.sum()


def twin(matcher: Matcher) -> np.ndarray:
    """exp(-MSD / sigma^2), exp(-RMS / sigma), 1 - MSD / M or 1 - the mean cost, tap by tap."""
    space, how = matcher.space, matcher.settings
    rows = fine_rows(matcher.scene.views, space.fineness).astype(float)
    if not how.colour:
        rows = np.repeat(np.tensordot(rows, [0.299, 0.587, 0.114], ([1], [0]))[:, None], 3, axis=1)
    limit, radius, q = how.truncation or np.inf, how.window // 2, space.fineness
    grey = np.tensordot(rows, [0.299, 0.587, 0.114], ([1], [0]))
    out = np.zeros((space.rows, len(matcher.pairs), space.planes, space.columns))
    for y, p, k, c in np.ndindex(out.shape):
        i, j = matcher.pairs[p]
        ui, uj = c - space.start(i, k), c - space.start(j, k)
        if not (0 <= ui < space.samples and 0 <= uj < space.samples):
            continue
        taps = []
        for dy in range(-radius, radius + 1):
            for dx in range(-radius * q, radius * q + 1, q):
                inside = 0 <= y + dy < space.rows
                if inside and min(ui, uj) + dx >= 0 and max(ui, uj) + dx < space.samples:
                    gap = rows[i, :, y + dy, ui + dx] - rows[j, :, y + dy, uj + dx]
                    if how.similarity not in ("mixed", "census"):
                        taps.append(min(np.mean(gap**2), limit**2))
                        continue
                    at = (i, ui + dx), (j, uj + dx)
                    order = [darker(grey[v], y + dy, u, q) for v, u in at]
                    like = [like_middle(rows[v], y + dy, u, q, how.alike) for v, u in at] if how.alike else None
                    cost = min(differing(order, like), 20) / 20
                    if how.similarity == "mixed":
                        slopes = [slope(grey[v, y + dy], u, q) for v, u in at]
                        cost *= 0.40
                        cost += 0.35 * min(np.mean(np.abs(gap)), limit) / 20
                        cost += 0.25 * min(abs(slopes[0] - slopes[1]), 10) / 10
                    taps.append(cost)
        mean = np.mean(taps)
        forms = {
            "ssd": np.exp(-mean / how.sigma**2),
            "rms": np.exp(-np.sqrt(mean) / how.sigma),
            "linear": max(0.0, 1 - mean / (how.truncation or 255) ** 2),
        }
        out[y, p, k, c] = forms.get(how.similarity, max(0.0, 1 - mean))
    return out


@settings(max_examples=25, deadline=None)
@given(
    n=st.integers(2, 4),
    height=st.integers(1, 5),
    width=st.integers(1, 7),
    least=st.integers(-2, 1),
    extent=st.integers(0, 3),
    fineness=st.integers(1, 3),
    window=st.sampled_from([1, 3, 5]),
    which=st.sampled_from(["all", "consecutive", "reference"]),
    form=st.sampled_from(["ssd", "rms", "linear", "census", "mixed"]),
    truncation=st.sampled_from([0.0, 60.0]),
    colour=st.booleans(),
    most=st.sampled_from([0.0, 30.5, 100.5]),
    seed=st.integers(0, 99),
)
def test_similarity_is_its_equation(
    n, height, width, least, extent, fineness, window, which, form, truncation, colour, most, seed
):
    scene = random_scene(n, height, width, least, least + extent, seed)
    matcher = Matcher.of(
        scene,
        Matching(
            views=0,
            fineness=fineness,
            pairs=which,
            similarity=form,
            window=window,
            sigma=70.0,
            truncation=truncation,
            colour=colour,
            alike=most,
        ),
    )
    rho, expected = matcher.all(), twin(matcher)
    # half a byte of rounding
    assert np.abs(rho / 255 - expected).max() <= 0.5 / 255 + 2e-5
    assert not rho[expected == 0].any()


@settings(max_examples=25, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 2), st.sampled_from([1, 3]), st.integers(1, 5), st.integers(1, 12)),
    fineness=st.integers(1, 3),
    most=st.sampled_from([1.0, 2.0, 4.0]),
    seed=st.integers(0, 99),
)
def test_same_surface_is_what_is_near_or_of_a_colour(shape, fineness, most, seed):
    rows = np.random.default_rng(seed).integers(-3, 4, shape).astype(np.float32)
    bits = same_surface(rows, fineness, most)
    assert bits.shape == (shape[0], 3, *shape[2:])
    for view, y, x in np.ndindex(shape[0], *shape[2:]):
        like = np.delete(like_middle(rows[view], y, x, fineness, most).ravel(), 24)
        assert "".join(f"{word:016b}" for word in bits[view, :, y, x]) == "".join(map(str, like.astype(int)))


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
