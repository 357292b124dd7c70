"""Finer rows follow the cubic convolution of Keys (1981)."""

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from rigs import uneven

from matbench import load_scene
from matbench.algorithm import Algorithm, Context, unsupported
from matbench.algorithms.dynamic_programming import DynamicProgramming
from matbench.algorithms.guided_filter import GuidedFilter
from matbench.algorithms.okutomi_kanade import OkutomiKanade
from matbench.algorithms.sampling import fine_rows, grid, off_grid, search_space
from matbench.algorithms.sgbm import SGBM
from matbench.algorithms.ssd import SSD
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


@settings(max_examples=30, deadline=None)
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


@pytest.mark.parametrize(
    ("positions", "places"),
    [
        ((0, 1, 2), (0, 1, 2)),
        ((0, 1, 2.5), (0, 2, 5)),
        ((0, 1, 7 / 3), (0, 3, 7)),
        ((0, 0.125, 1), (0, 1, 8)),
        ((0, 1, 2.47), None),
        ((0, 1 / 7, 1 + 1 / 5), None),
    ],
)
def test_views_lie_on_a_grid_of_parts_of_a_step_or_are_declined(
    positions: tuple[float, ...], places: tuple[int, ...] | None
) -> None:
    views = np.zeros((3, 2, 40, 3), np.uint8)
    scene = Scene("three", views, ("0", "1", "2"), 0, Range(-1, 4), {}, 1, positions=positions)
    found, why = grid(scene), off_grid(scene)
    if places is None:
        assert found is None
        assert f"at {scene.where}, lie on none of up to 8 parts of a step" in str(why)
        return
    assert why is None
    assert found is not None
    assert found[1] == places
    parts = places[1] / positions[1]
    assert found[0].disparities.largest == pytest.approx(4 / parts)
    assert search_space(found[0]).fineness == round(parts)  # planes one pixel of the pair apart


@pytest.mark.parametrize("method", [OkutomiKanade(), SSD(), GuidedFilter(), SGBM(), DynamicProgramming()])
def test_views_at_uneven_steps_give_disparities_per_view_step(method: Algorithm) -> None:
    scene = uneven(load_scene("synthetic/box[n=6 ref=2 size=96x72]"), (0, 2, 5), 2)
    assert not unsupported(method, scene)
    found = method.solve(scene, Context()).disparity[1]
    assert np.mean(np.abs(found - scene.truth[1]) * scene.pair_steps > 1) < 0.05
    assert unsupported(method, evolve(scene, positions=(0, 1, 2.47))) or isinstance(method, SGBM | DynamicProgramming)
