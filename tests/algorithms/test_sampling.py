"""Finer rows follow the cubic convolution of Keys (1981)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from matbench.algorithms.sampling import fine_rows, search_space
from matbench.scene import Range, Scene


def keys(s: float) -> float:
    """Keys' kernel with a = -1/2, at a distance of s pixels."""
    s = abs(s)
    if s < 1:
        return 1.5 * s**3 - 2.5 * s**2 + 1
    return -0.5 * s**3 + 2.5 * s**2 - 4 * s + 2 if s < 2 else 0.0


def slow(images: NDArray[np.uint8], fineness: int) -> NDArray[np.float64]:
    """Every sample as a sum over the four pixels around it."""
    n, height, width, _ = images.shape
    out = np.zeros((n, 3, height, fineness * (width - 1) + 1))
    for m in range(out.shape[3]):
        at, base = m / fineness, m // fineness
        for column in range(base - 1, base + 3):
            pixel = images[:, :, min(max(column, 0), width - 1)].astype(float)
            out[..., m] += keys(at - column) * np.moveaxis(pixel, 2, 1)
    return out


@settings(max_examples=30)
@given(st.integers(1, 3), st.integers(1, 7), st.integers(1, 5), st.integers(0, 99))
def test_agrees_with_the_explicit_kernel(height: int, width: int, fineness: int, seed: int) -> None:
    images = np.random.default_rng(seed).integers(0, 256, (2, height, width, 3), dtype=np.uint8)
    fine = fine_rows(images, fineness)
    assert fine.dtype == np.float32
    np.testing.assert_allclose(fine, slow(images, fineness), atol=1e-3)
    np.testing.assert_array_equal(fine[..., ::fineness], np.moveaxis(images, 3, 1))


def test_a_ramp_stays_a_ramp_inside() -> None:
    ramp = np.broadcast_to(np.arange(0, 80, 8, dtype=np.uint8)[:, None], (1, 2, 10, 3))
    fine = fine_rows(ramp, 4)
    np.testing.assert_allclose(fine[0, 0, 0, 4:-4], np.arange(37)[4:-4] * 2)


@pytest.mark.parametrize(
    ("pair_steps", "fineness", "first", "last", "q"),
    [(4, 0, -4, 10, 4), (1, 0, -1, 3, 1), (0.5, 0, -1, 3, 1), (2.5, 0, -3, 8, 3), (4, 2, -2, 5, 2)],
)
def test_planes_are_at_most_a_pixel_of_the_pair_apart(
    pair_steps: float, fineness: int, first: int, last: int, q: int
) -> None:
    scene = Scene("s", np.zeros((3, 2, 5, 3), np.uint8), tuple("abc"), 1, Range(-1, 2.5), {}, pair_steps)
    space = search_space(scene, fineness)
    assert (space.first, space.last, space.fineness) == (first, last, q)
