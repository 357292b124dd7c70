"""A folder of one's own scene, with and without a right scene.toml."""

from pathlib import Path

import numpy as np
import pytest
from scene_files import Layers, pfm_bytes, write_png

from matbench import load_scene
from matbench.errors import UserError

WORLD = Layers(near=6.0, far=2.0)
TRUTH = WORLD.truth()
NAMES = ["left.png", "middle.png", "right.png"]
MINIMAL = f"views = {NAMES}\ndisparities = [0, 8]\n"
TRUTHFUL = "[truth.middle]\nfile = 'map.pfm'\n"


def folder(place: Path) -> Path:
    """Three views, and truth of the middle one in every encoding; no scene.toml yet."""
    folder = place / "my scene"
    folder.mkdir()
    for step, name in enumerate(NAMES):
        write_png(folder / name, WORLD.view(step - 1))
    truth = TRUTH.copy()
    truth[:3] = np.nan
    grey = np.nan_to_num(truth * 16).astype(np.uint16)
    write_png(folder / "grey8.png", grey.astype(np.uint8))
    write_png(folder / "grey16.png", grey * 256)
    (folder / "grey8.pgm").write_bytes(b"P5 96 80 255\n" + grey.astype(np.uint8).tobytes())
    (folder / "grey16.pgm").write_bytes(b"P5\n96 80\n65535\n" + (grey * 256).astype(">u2").tobytes())
    (folder / "map.pfm").write_bytes(pfm_bytes(truth))
    (folder / "map0.pfm").write_bytes(pfm_bytes(np.nan_to_num(truth), little=False))
    return folder


def write(folder: Path, text: str) -> str:
    (folder / "scene.toml").write_text(text)
    return str(folder)


def refused(folder: Path, text: str, *words: str) -> None:
    name = write(folder, text)
    with pytest.raises(UserError) as caught:
        load_scene(name)
    message = str(caught.value)
    assert len(message.splitlines()) == 1, message
    assert all(word in message for word in words), message
