"""What is compared besides colour, against a walk over the pixels around."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbours import like_middle

from matbench.algorithms.features import SHIFTS, gradient, same_surface, strengthened


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
    assert bits.shape == (shape[0], 6, *shape[2:])
    for view, y, x in np.ndindex(shape[0], *shape[2:]):
        like = np.delete(like_middle(rows[view], y, x, fineness, most).ravel(), 24)
        assert "".join(f"{word:08b}" for word in bits[view, :, y, x]) == "".join(map(str, like.astype(int)))


def usual(slopes, y, x, fineness):
    """Root mean square of the slopes in the 5x5 pixels around a sample, those beyond an edge mirrored."""
    wide = np.pad(slopes.astype(float), ((2, 2), (2 * fineness, 2 * fineness)), mode="symmetric")
    return np.sqrt(np.mean(wide[y : y + 5, x : x + 4 * fineness + 1] ** 2))


@settings(max_examples=25, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 2), st.integers(1, 7), st.integers(1, 12)),
    fineness=st.integers(1, 3),
    texture=st.sampled_from([0.5, 6.0, 80.0]),
    spread=st.sampled_from([0.1, 3.0, 60.0]),
    seed=st.integers(0, 99),
)
def test_weak_slopes_become_as_strong_as_texture(shape, fineness, texture, spread, seed):
    slopes = np.random.default_rng(seed).normal(0, spread, shape).astype(np.float32)
    found = strengthened(slopes, fineness, texture)
    for view, y, x in np.ndindex(shape):
        much = max(1, texture / (usual(slopes[view], y, x, fineness) + 0.2))
        expected = np.clip(slopes[view, y, x] * much, -SHIFTS[1], SHIFTS[1])
        np.testing.assert_allclose(found[view, y, x], expected, rtol=1e-5)


def test_slopes_stay_without_texture_and_for_any_number_of_threads():
    grey = np.random.default_rng(1).normal(100, 2, (3, 40, 61)).astype(np.float32)
    slopes = gradient(grey, 2)
    assert np.array_equal(strengthened(slopes, 2, 0), slopes)
    assert np.array_equal(strengthened(slopes, 2, 6.0, 1), strengthened(slopes, 2, 6.0, 3))
    assert np.abs(strengthened(slopes, 2, 6.0)).mean() > 2 * np.abs(slopes).mean()
