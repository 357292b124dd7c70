"""Random numbers that stay the same with every version of NumPy, and the pattern made of them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def random_bytes(seed: Sequence[int], count: int) -> NDArray[np.uint8]:
    """Random bytes from the raw bits of a generator: NumPy promises only these to stay the same."""
    words = np.random.PCG64(np.random.SeedSequence(list(seed))).random_raw(-(-count // 8))
    return np.asarray(words, "<u8").view(np.uint8)[:count]


def noise(seed: Sequence[int], shape: tuple[int, ...], deviation: float) -> NDArray[np.float64]:
    """Noise of that standard deviation: sums of four random bytes, which are nearly normally distributed."""
    count = int(np.prod(shape))
    values: NDArray[np.float64] = (
        random_bytes(seed, 4 * count).reshape(4, count).sum(axis=0, dtype=np.int16).astype(float)
    )
    values -= 510
    values *= deviation / float(np.sqrt(4 * (256**2 - 1) / 12))
    return values.reshape(shape)


def pattern(seed: int, size: int = 256, cells: Sequence[int] = (4, 8, 16, 32, 64)) -> NDArray[np.float32]:
    """(size, size, 3) float32 periodic pattern, mean 0, deviation 1: a sum of smoothly interpolated random grids.

    The three channels have a large part in common, so that colours are muted.
    """
    total = np.zeros((size, size, 3))
    for octave, count in enumerate(cells):
        grid = random_bytes((seed, 1, octave), count * count * 4).reshape(count, count, 4) / 127.5 - 1
        grid = 0.6 * grid[..., :3] + grid[..., 3:]
        place = np.arange(size) * count / size
        first = place.astype(np.intp)
        t = place - first
        weight = (t * t * (3 - 2 * t))[:, None, None]
        for _ in range(2):  # down, then across
            grid = grid[first] * (1 - weight) + grid[(first + 1) % count] * weight
            grid = grid.transpose(1, 0, 2)
        total += grid
    total -= total.mean()
    relief: NDArray[np.float32] = np.clip(total / total.std(), -2.5, 2.5).astype(np.float32)
    return relief


def lookup(marks: NDArray[np.float32], across: NDArray[np.float64], down: NDArray[np.float64]) -> NDArray[np.float32]:
    """(points, 3) values of a periodic pattern (size, size, 3) of period 1, linear between samples."""
    size = marks.shape[0]
    x, y = across * size, down * size
    left, top = np.floor(x), np.floor(y)
    u, v = ((a - b).astype(np.float32)[:, None] for a, b in ((x, left), (y, top)))
    i, j = (a.astype(np.intp) % size for a in (left, top))
    right, row, below = (i + 1) % size, j * size, (j + 1) % size * size
    flat = marks.reshape(-1, 3)
    upper = flat.take(row + i, axis=0) * (1 - u) + flat.take(row + right, axis=0) * u
    lower = flat.take(below + i, axis=0) * (1 - u) + flat.take(below + right, axis=0) * u
    out: NDArray[np.float32] = upper * (1 - v) + lower * v
    return out
