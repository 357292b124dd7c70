"""Writing the files that scenes are read from, by means of their own."""

import struct
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

CALIB = """cam0=[3979.911 0 1244.772; 0 3979.911 1019.507; 0 0 1]
cam1=[3979.911 0 1369.115; 0 3979.911 1019.507; 0 0 1]
doffs=124.343
baseline=193.001
width=96
height=80
ndisp=24
isint=0
vmin=3
vmax=10
dyavg=0.918
dymax=1.516
"""
"""Of a pair in Middlebury's layout since 2014."""


def write_png(path: Path, image: NDArray[np.integer]) -> None:
    """(H, W) or (H, W, 3) RGB of 8 or 16 bits."""
    path.write_bytes(cv2.imencode(".png", image[..., ::-1] if image.ndim == 3 else image)[1].tobytes())


def pfm_bytes(values: NDArray[np.floating], little: bool = True, kind: str = "Pf") -> bytes:
    """A PFM file as its description says: number by number, from the bottom row up."""
    height, width = values.shape[:2]
    order = "<" if little else ">"
    rows = [struct.pack(f"{order}{row.size}f", *row.ravel().tolist()) for row in values[::-1]]
    return f"{kind}\n{width} {height}\n{-1.0 if little else 1.0}\n".encode() + b"".join(rows)


class Layers:
    """A textured board before a textured wall, seen by a camera moved across and down."""

    def __init__(self, width: int = 96, height: int = 80, near: float = 2.5, far: float = -1.25, seed: int = 0) -> None:
        self.width, self.height, self.near, self.far = width, height, near, far
        self.board = (0.3 * width, 0.65 * width, 0.2 * height, 0.75 * height)
        rng = np.random.default_rng(seed)
        self.waves = rng.uniform(0.12, 0.75, (2, 14, 2)) * rng.choice([-1, 1], (2, 14, 2))
        self.phases = rng.uniform(0, 7, (2, 14, 3))

    def _texture(self, layer: int, x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.floating]:
        angle = np.multiply.outer(x, self.waves[layer, :, 0]) + np.multiply.outer(y, self.waves[layer, :, 1])
        return np.sin(angle[..., None] + self.phases[layer]).sum(axis=-2) * 16 + (150, 120, 100)

    def _grid(self, across: float, down: float, disparity: float) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        y, x = np.mgrid[: self.height, : self.width].astype(float)
        return x + across * disparity, y + down * disparity

    def _on_board(self, across: float, down: float) -> NDArray[np.bool_]:
        x, y = self._grid(across, down, self.near)
        left, right, top, bottom = self.board
        return (x > left) & (x < right) & (y > top) & (y < bottom)

    def view(self, across: float, down: float = 0.0) -> NDArray[np.uint8]:
        """(H, W, 3) RGB; a point of the middle view moves left by d for each step across, up for each step down."""
        wall = self._texture(0, *self._grid(across, down, self.far))
        board = self._texture(1, *self._grid(across, down, self.near))
        picture = np.where(self._on_board(across, down)[..., None], board, wall)
        return np.clip(np.rint(picture), 0, 255).astype(np.uint8)

    def truth(self, across: float = 0.0, down: float = 0.0) -> NDArray[np.float32]:
        return np.where(self._on_board(across, down), self.near, self.far).astype(np.float32)


def write_pair(folder: Path, world: Layers) -> None:
    """A pair in Middlebury's layout since 2014; the truth of two rows is unknown."""
    folder.mkdir(parents=True)
    for view in (0, 1):
        write_png(folder / f"im{view}.png", world.view(view))
        truth = world.truth(view)
        truth[:2] = np.inf
        (folder / f"disp{view}.pfm").write_bytes(pfm_bytes(truth))
    (folder / "calib.txt").write_text(CALIB)


def check_one_line(error: Exception) -> None:
    """What a user is told is one line."""
    assert len(str(error).splitlines()) == 1, error
