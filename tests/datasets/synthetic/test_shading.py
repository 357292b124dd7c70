"""Colours of rays and pixels, against plain twins."""

import numpy as np
import pytest
from attrs import evolve

from matbench.datasets.synthetic import casting, shading, solids
from matbench.datasets.synthetic.materials import SIZE, STARTS, STEPS, Material, tile
from matbench.datasets.synthetic.solids import Model, Skin, Solid, flat, round_

LIGHT = np.array([0.0, -0.6, -0.8, 0.5, 0.0])
WIDTH, HEIGHT = 60, 44
WALL = (0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


@pytest.fixture(scope="module")
def tiles() -> np.ndarray:
    return tile(1, Material())[None]


def shown(
    found: list[Solid], tiles: np.ndarray, scale: int = 1, eye: float = 0.0, highlight: float = 0.0
) -> np.ndarray:
    """(H, W, 3) the picture, `scale` times as large."""
    model, focal, light = Model.of(found), float(WIDTH * scale), LIGHT.copy()
    light[4] = highlight
    middle, top = (WIDTH * scale - 1) / 2, (HEIGHT * scale - 1) / 2
    rights, downs = (np.arange(WIDTH * scale) - middle) / focal, (np.arange(HEIGHT * scale) - top) / focal
    depth, index = np.empty((HEIGHT * scale, WIDTH * scale)), np.empty((HEIGHT * scale, WIDTH * scale), np.int64)
    windows = model.windows(eye)
    casting.depths(model.kinds, model.rows, windows, eye, rights, downs, depth, index)
    out = np.empty((2, *depth.shape, 3), np.float32)
    shading.picture(
        model.kinds, model.rows, windows, model.skins, tiles, STARTS, eye, middle, focal, top, light, index, out
    )
    return out[1]


def skin(contrast: float = 0.0, gloss: float = 0.0, period: float = 6.0) -> Skin:
    return Skin(0, period, (0.1, 0.2), (0.8, 0.6), (100.0, 120.0, 140.0), contrast, gloss)


def test_a_plain_wall_has_its_colour_by_lamberts_law(tiles: np.ndarray) -> None:
    picture = shown([flat(solids.PLANE, *WALL, skin())], tiles)
    np.testing.assert_allclose(
        picture, np.broadcast_to(np.array([100, 120, 140]) * (0.5 + 0.5 * 0.8), picture.shape), rtol=1e-6
    )
    turned = shown([flat(solids.PLANE, (0, 0, 2), (0.8, 0, 0.6), (0, 1, 0), skin())], tiles)
    np.testing.assert_allclose(turned[..., 0], 100 * (0.5 + 0.5 * 0.8 * 0.8), rtol=1e-6)


def test_the_pattern_stands_where_the_ray_meets_the_wall(tiles: np.ndarray) -> None:
    """Every ray's place on the wall and in the tile, written out."""
    picture = shown([flat(solids.PLANE, *WALL, skin(20.0, period=30.0))], tiles)
    whole = tiles[0, : SIZE * SIZE].reshape(SIZE, SIZE, 3) / STEPS
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    total = np.zeros((HEIGHT, WIDTH, 3))
    for shift in (-0.25, 0.25):
        a, b = 2 * (x + shift - 29.5) / WIDTH, 2 * (y + shift - 21.5) / WIDTH
        u, v = (0.8 * a + 0.6 * b) / 30 + 0.1, (0.8 * b - 0.6 * a) / 30 + 0.2
        i, j = u * SIZE - 0.5, v * SIZE - 0.5
        left, above = np.floor(i).astype(int), np.floor(j).astype(int)
        s, t = (i - left)[..., None], (j - above)[..., None]
        at = lambda dy, dx: whole[(above + dy) % SIZE, (left + dx) % SIZE]  # noqa: B023, E731
        total += (at(0, 0) * (1 - s) + at(0, 1) * s) * (1 - t) + (at(1, 0) * (1 - s) + at(1, 1) * s) * t
    expected = (np.array([100, 120, 140]) + 20 * total / 2) * 0.9
    np.testing.assert_allclose(picture, expected, atol=1e-3)


@pytest.mark.parametrize("lean", [0.0, 1.5])
def test_a_picture_is_the_mean_of_a_finer_one(tiles: np.ndarray, lean: float) -> None:
    """Antialiased, on a slant and at outlines too: nearly as if every pixel were the mean of 8 x 8 smaller ones."""
    wall = flat(solids.PLANE, (0, 0, 2), (1, 0, lean), (0, 1, 0), skin(25.0, period=5.0))
    rod = round_(solids.TUBE, (0.1, 0, 1.5), ((0.01, 0, 0), (0, 0, 0.01), (0, 0.4, 0)), skin())
    scene = [wall, rod]
    coarse, fine = shown(scene, tiles), shown(scene, tiles, scale=8)
    means = fine.reshape(HEIGHT, 8, WIDTH, 8, 3).mean(axis=(1, 3))
    nearest = fine[4::8, 4::8]
    off, aliased = (float(np.sqrt(((other - means) ** 2).mean())) for other in (coarse, nearest))
    assert off < 0.45 * aliased
    assert float(coarse.mean()) == pytest.approx(float(means.mean()), rel=0.01)


def test_grain_and_tint_are_added_to_the_pattern(tiles: np.ndarray) -> None:
    wall = (0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    pattern = shown([flat(solids.PLANE, *wall, skin(20.0))], tiles)
    grain = shown([flat(solids.PLANE, *wall, evolve(skin(0.0), grain=20.0))], tiles)
    np.testing.assert_allclose(grain, pattern, atol=1e-3, err_msg="the same picture, once as grain")
    grey = shown([flat(solids.PLANE, *wall, evolve(skin(20.0), tint=0.0))], tiles) / 0.9 - (100, 120, 140)
    np.testing.assert_allclose(grey, np.broadcast_to(grey.mean(axis=2, keepdims=True), grey.shape), atol=1e-3)
    finer = shown([flat(solids.PLANE, *wall, evolve(skin(0.0, period=30.0), grain=20.0, fineness=4.0))], tiles)
    assert (
        np.abs(np.diff(finer, axis=1)).mean()
        > 1.2 * np.abs(np.diff(shown([flat(solids.PLANE, *wall, skin(20.0, period=30.0))], tiles), axis=1)).mean()
    )


def test_a_highlight_moves_with_the_camera_and_only_on_gloss(tiles: np.ndarray) -> None:
    def ball(gloss: float) -> list[Solid]:
        wall = flat(solids.PLANE, *WALL, skin())
        return [wall, round_(solids.BALL, (0, 0, 1.4), ((0.3, 0, 0), (0, 0.3, 0), (0, 0, 0.3)), skin(gloss=gloss))]

    dull, matt = shown(ball(1.0), tiles), shown(ball(0.0), tiles, highlight=80)
    np.testing.assert_array_equal(dull, matt)
    places = []
    for eye in (-0.3, 0.3):
        added = (shown(ball(1.0), tiles, eye=eye, highlight=80) - shown(ball(1.0), tiles, eye=eye))[..., 0]
        assert 40 < added.max() <= 80
        row, column = np.unravel_index(added.argmax(), added.shape)
        places.append(1.4 * (column - 29.5) / WIDTH + eye)
        assert row < 22, "the light comes from above"
    assert abs(places[1] - places[0]) > 0.03, "not where the same point of the ball is"
