"""OpenCV's SGBM behind the one interface: which pair, which range, and answers for every pixel."""

import numpy as np
import pytest
from numpy.typing import NDArray

from matbench.algorithm import Context
from matbench.algorithms.sgbm import SGBM, field_partner
from matbench.scene import Range, Scene

WIDTH, REACH = 80, 40


def noise(shape: tuple[int, ...], seed: int) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def wall(disparity: int, n: int, ref: int, least: float, largest: float, pair_steps: float = 1) -> Scene:
    """n noisy views of a wall, view j cut from one texture j * disparity further right."""
    texture = noise((24, WIDTH + 2 * REACH, 3), 1)
    starts = [REACH + (j - ref) * disparity for j in range(n)]
    views = np.stack([texture[:, s : s + WIDTH] for s in starts])
    return Scene("wall", views, tuple(map(str, range(n))), ref, Range(least, largest), {}, pair_steps)


@pytest.mark.parametrize(
    ("n", "ref", "pair_steps", "partner"),
    [
        (9, 2, 4, 6),
        (5, 2, 1, 3),
        (5, 4, 1, 3),
        (7, 5, 4, 1),
        (4, 1, 2, 3),
        (4, 1, 4, 3),
        (4, 2, 4, 0),
        (3, 1, 5, 2),
        (3, 2, 0.25, 1),
    ],
)
def test_partner(n: int, ref: int, pair_steps: float, partner: int) -> None:
    assert field_partner(wall(0, n, ref, 0, 1, pair_steps)) == partner


@pytest.mark.parametrize("disparity", [-3, -1, 0, 2, 4])
@pytest.mark.parametrize(("n", "ref", "pair_steps"), [(3, 0, 1), (3, 2, 1), (5, 1, 2), (5, 3, 2)])
def test_wall_in_pixels_per_view_step(disparity: int, n: int, ref: int, pair_steps: float) -> None:
    scene = wall(disparity, n, ref, -4, 5, pair_steps)
    found = SGBM().solve(scene, Context()).disparity[ref]
    assert found.dtype == np.float32
    margin = 2 * abs(disparity) + 3  # where the partner sees it
    np.testing.assert_allclose(found[:, margin:-margin], disparity, atol=0.1)
    assert not np.isnan(found).any()


@pytest.mark.parametrize(("least", "largest"), [(-20, -2), (-7, 30), (3, 3), (0, 15), (11, 60)])
@pytest.mark.parametrize("mode", ["sgbm", "hh", "three_way"])
def test_answers_stay_in_the_range(least: int, largest: int, mode: str) -> None:
    scene = wall(3, 2, 0, least, largest)
    found = SGBM(mode=mode, fill=False).solve(scene, Context()).disparity[0]  # type: ignore[arg-type]
    known = found[~np.isnan(found)]
    assert ((known >= least) & (known <= largest)).all()
    if least < 3 < largest:  # every pixel whose match is in the picture is tried, the range's width from the side too
        np.testing.assert_allclose(found[:, 6:-6], 3, atol=0.1)


def test_holes_stay_on_request() -> None:
    views = np.stack([noise((20, 60, 3), 1), noise((20, 60, 3), 2)])
    scene = Scene("unlike", views, ("0", "1"), 0, Range(0, 15), {}, 1)
    sparse = SGBM(fill=False).solve(scene, Context()).disparity[0]
    assert np.isnan(sparse).mean() > 0.5
    full = SGBM().solve(scene, Context()).disparity[0]
    assert np.isnan(sparse).all() or not np.isnan(full).any()


@pytest.mark.parametrize("mode", ["sgbm", "hh", "three_way"])
@pytest.mark.parametrize("block_size", [1, 3, 7])
def test_narrow_images_neither_fail_nor_vary(mode: str, block_size: int) -> None:
    method = SGBM(mode=mode, block_size=block_size)  # type: ignore[arg-type]
    for height, width in [(1, 1), (1, 30), (30, 1), (2, 2), (5, 4), (9, 17)]:
        left, right = noise((2, height, width, 3), width)
        for least, largest in [(0, 15), (0, 59), (-40, -20), (-8, 7), (5, 70)]:
            first = method.match(left, right, least, largest)
            assert first.shape == (height, width)
            for seed in range(3):
                used = [noise((size,), seed) for size in (1_000, 30_000, 300_000)]  # memory with something in it
                del used
                np.testing.assert_array_equal(method.match(left, right, least, largest), first)


def test_threads_and_repetition_change_nothing() -> None:
    scene = wall(3, 3, 1, -4, 12)
    before = scene.views.copy()
    once, again, threaded = (SGBM().solve(scene, Context(threads=t)).disparity[1] for t in (1, 1, 2))
    np.testing.assert_array_equal(once, again)
    np.testing.assert_array_equal(once, threaded)
    np.testing.assert_array_equal(scene.views, before)


def test_constant_images() -> None:
    scene = Scene("flat", np.full((2, 10, 40, 3), 9, np.uint8), ("0", "1"), 0, Range(0, 15), {}, 1)
    assert SGBM().solve(scene, Context()).disparity[0].shape == (10, 40)


@pytest.mark.parametrize(
    "wrong",
    [
        {"block_size": 2},
        {"mode": "bm"},
        {"p1": 0},
        {"p2": 8},
        {"uniqueness": 101},
        {"speckle_window": -1},
        {"speckle_range": -1},
        {"disp12_max_diff": 0},
    ],
)
def test_wrong_parameters(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SGBM(**wrong)  # type: ignore[arg-type]
