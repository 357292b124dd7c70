"""The guided filter against its definition, window by window."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.guidance import Guidance


def slow(image: NDArray[np.uint8], values: NDArray[np.float32], radius: int, epsilon: float) -> NDArray[np.float64]:
    """Every window explains its values by least squares with a ridge on the slopes; a pixel takes the mean."""
    colours = image / 255
    total, count = np.zeros(values.shape), np.zeros(values.shape)
    for y, x in np.ndindex(values.shape):
        window = np.s_[max(0, y - radius) : y + radius + 1, max(0, x - radius) : x + radius + 1]
        inside, wanted = colours[window].reshape(-1, 3), values[window].ravel().astype(float)
        around, level = inside - inside.mean(axis=0), wanted.mean()
        slopes = np.linalg.solve(
            around.T @ around / len(inside) + epsilon * np.eye(3), around.T @ (wanted - level) / len(inside)
        )
        total[window] += (colours[window] - inside.mean(axis=0)) @ slopes + level
        count[window] += 1
    return total / count


def test_agrees_with_its_definition() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (9, 13, 3), np.uint8)
    values = rng.random((9, 13), np.float32)
    for radius, epsilon in ((1, 1e-2), (2, 1e-4), (20, 1e-3)):
        found = Guidance.of(image, radius, epsilon).filter(values)
        np.testing.assert_allclose(found, slow(image, values, radius, epsilon), atol=2e-3)


def test_edges_of_the_picture_stay() -> None:
    image = np.zeros((12, 20, 3), np.uint8)
    image[:, 10:] = 200
    noise = np.random.default_rng(1).normal(0, 0.1, (12, 20))
    values = (noise + (np.arange(20) >= 10)).astype(np.float32)
    found = Guidance.of(image, 3, 1e-4).filter(values)
    assert found[:, 9].max() < 0.2 < 0.8 < found[:, 10].min()
    assert found[:, :8].std() < 0.5 * values[:, :8].std()
