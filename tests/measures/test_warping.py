"""Maps carried into another view, and its colours brought back."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from matbench.measures.warping import TEAR, carry, warped

NAN = np.nan


def _slow_carry(disparity: np.ndarray, steps: float) -> np.ndarray:
    """The twin: pixel by pixel, segment by segment."""
    height, width = disparity.shape
    out = np.full((height, width), np.nan)

    def put(y: int, x: float, value: float) -> None:
        if 0 <= x < width and not out[y, int(x)] >= value:
            out[y, int(x)] = value

    for y, row in enumerate(disparity.astype(float)):
        joined = [abs(steps) * abs(b - a) <= TEAR + 1e-4 for a, b in pairwise(row)]
        for x, d in enumerate(row):
            if np.isnan(d):
                continue
            if not (x > 0 and joined[x - 1] and x < width - 1 and joined[x]):
                put(y, np.floor(x - steps * d + 0.5), d)
            if x < width - 1 and joined[x]:
                start, end = x - steps * d, x + 1 - steps * row[x + 1]
                for column in range(width):
                    if end - start > 1e-4 and start - 1e-4 <= column <= end + 1e-4:
                        put(y, column, d + (column - start) / (end - start) * (row[x + 1] - d))
    return out


@given(st.integers(0, 2**32 - 1), st.sampled_from([-3, -1.5, -1, 1, 2, 2.5]), st.booleans())
def test_carrying_has_a_slow_twin(seed: int, steps: float, smooth: bool) -> None:
    rng = np.random.default_rng(seed)
    values = rng.uniform(-2, 4, (3, 17))
    disparity = (np.cumsum(values - 1, axis=1) / 8 if smooth else values).astype(np.float32)
    disparity[rng.random(disparity.shape) < 0.1] = np.nan
    np.testing.assert_allclose(carry(disparity, steps), _slow_carry(disparity, steps), atol=1e-9)


def test_nearest_counts_and_slants_leave_no_holes() -> None:
    flat = np.array([[1, 1, 1, 1, 4, 4, 1, 1, NAN]], np.float32)
    # carried to -1 0 1 2 | 0 1 | 5 6; torn between
    np.testing.assert_array_equal(carry(flat, 1)[0], [4, 4, 1, NAN, NAN, 1, 1, NAN, NAN])
    slant = (np.arange(30) * -0.9)[None].astype(np.float32)
    there = carry(slant, 1)[0]
    assert np.isfinite(there).all(), "1.9 columns apart"
    np.testing.assert_allclose(there, np.arange(30) / 1.9 * -0.9, atol=1e-5)


def _cubic(row: np.ndarray, at: float) -> np.ndarray:
    """Keys' cubic through four neighbours, a = -0.75, ends repeated."""

    def weight(t: float) -> float:
        t, a = abs(t), -0.75
        return (
            (a + 2) * t**3 - (a + 3) * t**2 + 1
            if t <= 1
            else a * t**3 - 5 * a * t**2 + 8 * a * t - 4 * a
            if t < 2
            else 0
        )

    first = int(np.floor(at)) - 1
    return sum(row[np.clip(k, 0, len(row) - 1)].astype(float) * weight(at - k) for k in range(first, first + 4))


def test_warping_is_sampling_along_the_row() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (4, 30, 3), np.uint8)
    disparity = rng.uniform(-3, 3, (4, 30)).astype(np.float32)
    disparity = (np.rint(disparity * 16) / 16).astype(np.float32)
    disparity[1, 5] = np.nan
    for steps in (-2, 1):
        found = warped(image, disparity, steps)
        for y in range(4):
            for x in range(30):
                at = x - steps * disparity[y, x]
                if np.isnan(at) or not 0 <= at <= 29:
                    assert np.isnan(found[y, x]).all()
                else:
                    np.testing.assert_allclose(found[y, x], _cubic(image[y], at), atol=0.05)
