import numpy as np
import pytest
from numpy.typing import NDArray

from matbench.algorithms.surfaces import (
    ACROSS,
    COLOUR,
    JUMP,
    NEAR,
    REACH,
    ROUNDS,
    STEADY,
    SURE,
    fitted,
    smoothed,
)

GREY = np.full((24, 40, 3), 128, np.uint8)


def some(seed: int, shape: tuple[int, int] = (6, 9)) -> tuple[NDArray[np.float32], ...]:
    random = np.random.default_rng(seed)
    image = random.integers(100, 110, (*shape, 3), dtype=np.uint8)
    found = (random.normal(size=shape) + np.arange(shape[1]) * 0.3).astype(np.float32)
    found[:, 5:] += 6  # a jump
    return found, random.uniform(0.05, 1, shape).astype(np.float32), image


def step(image: NDArray[np.uint8], found: NDArray[np.float32], a: int, b: int, reach: float) -> float:
    """Weight of a step between two pixels, counted row by row."""
    colours, values = image.reshape(-1, 3).astype(int), found.ravel()
    weight = float(np.exp(-1 / reach - np.abs(colours[a] - colours[b]).max() / COLOUR))
    return weight * (ACROSS if abs(values[a] - values[b]) > JUMP else 1)


def path_weights(image: NDArray[np.uint8], found: NDArray[np.float32]) -> NDArray[np.float64]:
    """(pixels, pixels) weight of the second pixel for the first, over all rounds of paths."""
    height, width = found.shape
    places = [(y, x) for y in range(height) for x in range(width)]
    total = np.eye(len(places))
    for number in range(ROUNDS):
        for axis in (1, 0):  # along rows, then down columns
            one = np.zeros_like(total)
            for p, here in enumerate(places):
                for q, there in enumerate(places):
                    if here[1 - axis] != there[1 - axis]:
                        continue
                    stride = 1 if axis == 1 else width
                    way = range(min(p, q), max(p, q), stride)
                    one[p, q] = np.prod([step(image, found, a, a + stride, REACH / 2**number) for a in way])
            total = one @ total
    return total


def slow_fit(found: NDArray[np.float32], sure: NDArray[np.float32], image: NDArray[np.uint8]) -> NDArray[np.float64]:
    """The twin of `fitted`: the weights of all pairs of pixels, and a regression at each."""
    weights = path_weights(image, found)
    places, values = np.argwhere(np.ones(found.shape, bool)).astype(float), found.ravel().astype(float)
    planes = np.empty_like(values)
    for p in range(values.size):
        w = weights[p] * sure.ravel()
        w /= w.sum()
        away = places - places[p]
        middle, value = w @ away, w @ values
        spread = (w[:, None] * (away - middle)).T @ (away - middle) + STEADY * np.eye(2)
        planes[p] = value - np.linalg.solve(spread, (w * (values - value)) @ (away - middle)) @ middle
    return planes.reshape(found.shape)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_planes_are_those_of_a_regression_at_every_pixel(seed: int) -> None:
    found, sure, image = some(seed)
    assert np.abs(fitted(found, sure, image) - slow_fit(found, sure, image)).max() < 2e-4


def test_steps_become_the_slope_that_they_stand_for() -> None:
    slope = np.broadcast_to(np.arange(40) * 0.15, (24, 40)).astype(np.float32)
    steps = np.round(slope / 2) * np.float32(2)
    sure = np.where(np.abs(steps - slope) < 0.1, 0.6, 0.02).astype(np.float32)
    before, after = (np.abs(found - slope).mean() for found in (steps, smoothed(steps, sure, GREY)))
    assert after < before / 2


def test_a_sure_pixel_keeps_its_own_disparity() -> None:
    found, _, image = some(4)
    sure = np.full(found.shape, SURE, np.float32)
    assert np.allclose(smoothed(found, sure, image), found, atol=1e-5)


def test_no_pixel_moves_to_a_surface_that_is_far() -> None:
    found, sure, image = some(5)
    found[2, 2] += 2 * NEAR + 4
    sure[2, 2] = 0.1
    assert smoothed(found, sure, image)[2, 2] == found[2, 2]


def test_unknown_sureness_is_none() -> None:
    found, sure, image = some(6)
    sure[1, 1:4] = np.nan
    none = np.nan_to_num(sure)
    assert np.array_equal(smoothed(found, sure, image), smoothed(found, none, image))
    assert np.isfinite(smoothed(found, sure, image)).all()


def test_surfaces_end_where_colours_change() -> None:
    image = GREY.copy()
    image[:, 20:] = 30
    found = np.where(np.arange(40) < 20, 5, 7).astype(np.float32) * np.ones((24, 1), np.float32)
    assert np.abs(smoothed(found, np.full(found.shape, 0.05, np.float32), image) - found).max() < 0.01


def test_a_map_of_one_pixel() -> None:
    one = np.full((1, 1), 3, np.float32)
    assert smoothed(one, np.zeros((1, 1), np.float32), GREY[:1, :1]) == 3
