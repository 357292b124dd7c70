"""The noise of images whose noise is known."""

import numpy as np
import pytest

from matbench.algorithms.noise import ROUNDING, noise_of


@pytest.mark.parametrize("deviation", [1.0, 4.0, 12.0])
def test_noise_over_slopes_and_edges_is_found(deviation: float) -> None:
    y, x = np.mgrid[:80, :90]
    clean = 60 + 0.5 * x + 0.3 * y + 40 * (x > 45)
    noisy = clean[..., None] + np.random.default_rng(0).normal(0, deviation, (2, 80, 90, 3))
    assert noise_of(np.rint(noisy).astype(np.uint8)) == pytest.approx(deviation, rel=0.08)


def test_what_rounding_adds_is_the_least() -> None:
    assert noise_of(np.zeros((1, 9, 9, 3), np.uint8)) == pytest.approx(ROUNDING)
    assert noise_of(np.zeros((1, 2, 2, 3), np.uint8)) == pytest.approx(ROUNDING)
