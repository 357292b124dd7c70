"""A scene of noise, and the pixels around one by explicit loops."""

import numpy as np

from matbench.scene import Range, Scene


def random_scene(n=3, height=4, width=6, least=-1.0, largest=2.0, seed=0, pair_steps=1.0):
    views = np.random.default_rng(seed).integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    labels = tuple(map(str, range(n)))
    return Scene("random", views, labels, n // 2, Range(least, largest), {}, pair_steps)


def around(values, y, sample, q):
    """(..., 7, 7) the pixels around, those beyond an edge taken from it."""
    height, samples = values.shape[-2:]
    near = np.arange(-3, 4)
    return values[..., np.clip(y + near, 0, height - 1), :][..., np.clip(sample + q * near, 0, samples - 1)]


def like_middle(rows, y, sample, q, most):
    """Which of the 7x7 pixels are next to the middle, or within `most` grey levels of it in every channel."""
    like = (np.abs(around(rows, y, sample, q) - rows[:, y, sample, None, None]) <= most).all(axis=0)
    like[2:5, 2:5] = True
    like[3, 3] = False
    return like
