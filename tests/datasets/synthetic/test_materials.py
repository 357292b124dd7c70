"""Pictures of materials: levelled, pinned, and with the statistics of natural images."""

from hashlib import sha256

import numpy as np
import pytest

from matbench.datasets.synthetic.materials import (
    GRAIN,
    MATERIALS,
    NUMBERS,
    SIZE,
    STARTS,
    STEPS,
    Material,
    library,
    tile,
)

KINDS = {
    "leaves": Material(grain=0.0),
    "grain": Material(leaves=0.0, grain=1.0),
    "print": Material(leaves=0.0, grain=0.0, print_=1.0),
    "weave": Material(leaves=0.0, grain=0.0, weave=1.0, pitch=16),
    "stripes": Material(leaves=0.0, grain=0.0, stripes=1.0),
}


@pytest.fixture(scope="module")
def tiles() -> dict[str, np.ndarray]:
    """Name -> (texels, 3), all levels, in deviations."""
    return {name: tile(seed, kind) / STEPS for seed, (name, kind) in enumerate(KINDS.items(), 1)}


def level(tile: np.ndarray, number: int) -> np.ndarray:
    wide = SIZE >> number
    return tile[STARTS[number] : STARTS[number + 1]].reshape(wide, wide, 3)


@pytest.mark.parametrize("name", KINDS)
def test_a_tile_is_level_and_its_levels_are_means(tiles: dict[str, np.ndarray], name: str) -> None:
    whole = level(tiles[name], 0)
    assert float(whole.mean()) == pytest.approx(0, abs=0.03)
    assert float(whole.std()) == pytest.approx(1, abs=0.05)
    for number in range(1, len(STARTS) - 1):
        wide = SIZE >> number
        means = whole.astype(float).reshape(wide, 1 << number, wide, 1 << number, 3).mean(axis=(1, 3))
        np.testing.assert_allclose(level(tiles[name], number), means, atol=1.01 / STEPS)


def test_tiles_are_pinned(tiles: dict[str, np.ndarray]) -> None:
    """They must be the same on every machine, as the pictures made of them are."""
    counted = {name: np.round(values * STEPS).astype(np.int8) for name, values in tiles.items()}
    assert {name: sha256(values.tobytes()).hexdigest()[:8] for name, values in counted.items()} == PINNED


PINNED = {
    "leaves": "d15af743",
    "grain": "4b712e3f",
    "print": "215a969d",
    "weave": "4f26eec7",
    "stripes": "3caaba67",
}


def amplitude(picture: np.ndarray) -> float:
    """Exponent of the amplitude spectrum over frequency, from 4 to 64 cycles across the picture."""
    spectrum = np.abs(np.fft.fft2(picture.mean(axis=2))) ** 2
    frequency = np.hypot(*np.meshgrid(*2 * [np.fft.fftfreq(SIZE, 1 / SIZE)]))
    edges = 2.0 ** np.arange(2, 7)
    power = [spectrum[(frequency >= a) & (frequency < 2 * a)].mean() for a in edges]
    return float(np.polyfit(np.log(edges), np.log(power), 1)[0] / 2)


def test_leaves_have_the_spectrum_and_the_tails_of_natural_images(tiles: dict[str, np.ndarray]) -> None:
    """Amplitude falls about as 1 / frequency (Field 1987: 0.8 to 1.5), and most differences are small, some large."""
    assert -1.5 < amplitude(level(tiles["leaves"], 0)) < -0.8
    steps = np.diff(level(tiles["leaves"], 1).mean(axis=2), axis=1).ravel()
    kurtosis = float(((steps - steps.mean()) ** 4).mean() / steps.var() ** 2)
    assert kurtosis > 8, "3 is that of a normal distribution"


def test_weave_repeats_and_leaves_do_not(tiles: dict[str, np.ndarray]) -> None:
    def likeness(name: str) -> float:
        grey = level(tiles[name], 0)[:, :, 0]
        return float((grey * np.roll(grey, 32, axis=1)).mean())

    assert likeness("weave") > 0.8
    assert likeness("leaves") < 0.5


def test_parts_are_weighed() -> None:
    both, leaves = (tile(1, Material(leaves=1, grain=grain))[: SIZE * SIZE] / STEPS for grain in (1.0, 0.0))
    share = float((both * leaves).mean())
    assert share == pytest.approx(np.sqrt(0.5), abs=0.06)


def test_the_library_makes_what_is_wanted() -> None:
    numbers = [number for kind in NUMBERS.values() for number in kind]
    assert numbers == list(range(len(MATERIALS)))
    assert NUMBERS["grain"] == (GRAIN,)
    weave = NUMBERS["cloth"][0]
    shelf = library([GRAIN, weave])
    assert shelf.shape == (len(MATERIALS), STARTS[-1], 3)
    for number in (GRAIN, weave):
        np.testing.assert_array_equal(shelf[number], tile(number + 1, MATERIALS[number]))
