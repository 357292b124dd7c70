"""Measuring how real scenes look: on pictures whose answers are known."""

import json
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve
from real import Real
from scipy.ndimage import gaussian_filter1d

from matbench.datasets.synthetic import SYNTHETIC, make_appearance
from matbench.datasets.synthetic.make_appearance import noise, patches, sharpness, spread
from matbench.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return SYNTHETIC.load("box", {"noise": "0"}, None)


def painted(scene: Scene, picture: np.ndarray) -> Scene:
    return evolve(scene, views=np.stack([picture] * scene.n))


def test_a_patch_is_described(scene: Scene) -> None:
    flat = np.tile(np.array([150, 100, 50], np.uint8), (180, 240, 1))
    assert patches(painted(scene, flat)) == 20 * [[100.0, 50.0, -50.0, 0.0, 0.0, 0.0]]
    ramp = np.repeat(np.arange(240, dtype=np.uint8)[None, :, None], 180, axis=0).repeat(3, axis=2)
    for brightness, red, blue, contrast, fine, colours in patches(painted(scene, ramp)):
        assert 9 < brightness < 230
        assert (red, blue, colours) == (0, 0, 0)
        assert contrast == pytest.approx(np.arange(20).std(), abs=0.1)
        assert fine < 0.2


@pytest.mark.parametrize("deviation", [1.0, 3.0])
def test_noise_is_measured(scene: Scene, deviation: float) -> None:
    drawn = np.random.default_rng(0).normal(120, deviation, (180, 240, 3))
    found = noise(painted(scene, np.clip(np.round(drawn), 0, 255).astype(np.uint8)))
    assert 0.6 * deviation < found < 1.05 * deviation, "in the flattest places it is rather too small"


@pytest.mark.parametrize("blur", [0.3, 0.5, 0.8])
def test_the_spread_of_edges_is_measured(blur: float) -> None:
    """Of bars that lie anywhere between pixels, seen by square pixels after that blur."""
    places, fine = np.arange(240 * 20) / 20, []
    for row in range(60):
        level = np.full(places.size, 60.0)
        for k in range(6):
            level[(places >= 15 + 40 * k + row / 60) & (places < 33 + 40 * k + row / 37)] = 180
        fine.append(gaussian_filter1d(level, 20 * blur).reshape(240, 20).mean(axis=1))
    assert spread(sharpness(np.array(fine))) == pytest.approx(blur, abs=0.05)


def test_the_file_is_what_the_scenes_give(real: Real, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = real(*make_appearance.SCENES)
    monkeypatch.setattr(make_appearance, "APPEARANCE", tmp_path / "appearance.json")
    kept = json.loads((Path(make_appearance.__file__).with_name("appearance.json")).read_text())
    make_appearance.main(["--data", str(root)])
    assert json.loads((tmp_path / "appearance.json").read_text()) == kept
