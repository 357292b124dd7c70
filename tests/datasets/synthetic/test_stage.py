"""Cameras before a random world: consistent with one another."""

from functools import cache

import numpy as np
import pytest

from matbench.datasets.synthetic.random_worlds import draw
from matbench.datasets.synthetic.stage import Stage


@cache
def stage(seed: int = 3, n: int = 3, size: tuple[int, int] = (80, 60)) -> Stage:
    return Stage(draw(seed), n, 1, 1, *size, (0.0,) * n)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_seen_in_another_view_lies_where_disparity_says(seed: int) -> None:
    """The other view's own ray meets the same depth there, within a pixel."""
    cameras = stage(seed)
    depth = cameras.depth(1)
    seen, disparity = cameras.visible(1, depth), cameras.disparity(depth)
    there = cameras.disparity(cameras.depth(2))
    places = np.arange(80) - disparity
    column = np.clip(np.floor(places + 0.5), 0, 79).astype(int)
    near = np.stack([np.take_along_axis(there, np.clip(column + k, 0, 79), axis=1) for k in (-1, 0, 1)])
    assert seen[1].all()
    assert not seen[2][(places < -0.5) | (places >= 79.5)].any()
    assert (np.abs(near - disparity).min(axis=0) < 0.3)[seen[2]].mean() > 0.99
    hidden = ~seen[2] & (places >= -0.5) & (places < 79.5)
    assert (near.max(axis=0) > disparity)[hidden].mean() > 0.98


def test_finer_samples_hold_the_pixels() -> None:
    np.testing.assert_array_equal(stage().depth(0, 3)[:, ::3], stage().depth(0))
    assert stage().depth(0, 3).shape == (60, 238)


def test_a_larger_picture_is_the_same_world() -> None:
    small, large = stage(), stage(size=(160, 120))
    a, b = small.disparity(small.depth(1)), large.disparity(large.depth(1))
    assert np.median(np.abs(2 * a - b[::2, ::2])) < 0.1


def test_a_lowered_camera_sees_the_same_lower_down() -> None:
    level = stage()
    lowered = Stage(level.drawn, 3, 1, 1, 80, 60, (0.0, 0.0, 5.0))
    np.testing.assert_allclose(lowered.depth(2)[5:], level.depth(2)[:-5], rtol=1e-9)
    depth = level.depth(1)
    kept = lowered.visible(1, depth)[2]
    np.testing.assert_array_equal(kept[:55], level.visible(1, depth)[2][:55])
    assert not kept[55:].any()


def test_pictures_follow_the_disparities() -> None:
    """Where both see a point, both see its colour: Lambert's law, and one pattern."""
    cameras = stage()
    depth = cameras.depth(1)
    one, other = cameras.picture(1), cameras.picture(2)
    places, seen = np.arange(80) - cameras.disparity(depth), cameras.visible(1, depth)[2]
    rows = np.broadcast_to(np.arange(60)[:, None], depth.shape)
    column = np.clip(np.floor(places + 0.5), 0, 79).astype(int)
    right = np.abs(other[rows, column] - one).mean(axis=2)[seen]
    wrong = np.abs(other[rows, np.clip(column + 6, 0, 79)] - one).mean(axis=2)[seen]
    assert np.median(right) < 0.5 * np.median(wrong)
