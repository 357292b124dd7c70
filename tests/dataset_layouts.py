"""A made-up pair, written as published datasets lay their files out."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scene_files import CALIB, Layers, pfm_bytes, write_png

WORLD = Layers(width=96, height=80, near=10.0, far=4.0)


def truth() -> NDArray[np.float32]:
    return WORLD.truth()


def seen() -> NDArray[np.bool_]:
    """What the right view sees: the board hides a strip from it, and its frame ends before some points."""
    columns, disparity = np.arange(WORLD.width), truth()
    there = columns - disparity
    board = WORLD.truth(1.0) == WORLD.near
    inside = there >= 0
    rows = np.arange(WORLD.height)[:, None]
    covered = board[rows, np.clip(np.rint(there), 0, WORLD.width - 1).astype(int)]
    return inside & ~(covered & (disparity == WORLD.far))


def scattered() -> NDArray[np.bool_]:
    """One pixel in five, as of a laser scanner."""
    return np.random.default_rng(0).random((WORLD.height, WORLD.width)) < 0.2


def _write(path: Path, image: NDArray[np.integer]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, image)


def eth3d(folder: Path) -> Path:
    folder.mkdir(parents=True)
    for view in (0, 1):
        write_png(folder / f"im{view}.png", WORLD.view(view))
    (folder / "disp0GT.pfm").write_bytes(pfm_bytes(truth()))
    write_png(folder / "mask0nocc.png", np.where(seen(), 255, 128).astype(np.uint8))
    (folder / "calib.txt").write_text(CALIB.replace("ndisp=24", "ndisp=24.0"))
    return folder


def kitti(folder: Path, year: int = 2015, frame: str = "000000_10") -> Path:
    left, right, occ, noc = {
        2015: ("image_2", "image_3", "disp_occ_0", "disp_noc_0"),
        2012: ("image_0", "image_1", "disp_occ", "disp_noc"),
    }[year]
    for view, side in enumerate((left, right)):
        image = WORLD.view(view)
        _write(folder / side / f"{frame}.png", image if year == 2015 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    stored = np.where(scattered(), truth() * 256, 0).astype(np.uint16)
    _write(folder / occ / f"{frame}.png", stored)
    _write(folder / noc / f"{frame}.png", np.where(seen(), stored, 0).astype(np.uint16))
    return folder


def sintel(folder: Path, frame: str = "alley_1/frame_0001") -> Path:
    for rendered in ("clean", "final"):
        for view, side in enumerate(("left", "right")):
            _write(
                folder / f"{rendered}_{side}" / f"{frame}.png", WORLD.view(view) // (1 if rendered == "clean" else 2)
            )
    whole = np.floor(truth() * (1 << 14)).astype(np.int64)  # 4 R + G / 2^6 + B / 2^14
    red, green, blue = whole >> 16, (whole >> 8) & 255, whole & 255
    _write(folder / "disparities" / f"{frame}.png", np.stack([red, green, blue], 2).astype(np.uint8))
    inside = np.arange(WORLD.width) - truth() >= 0
    _write(folder / "occlusions" / f"{frame}.png", np.where(inside & ~seen(), 255, 0).astype(np.uint8))
    _write(folder / "outofframe" / f"{frame}.png", np.where(inside, 0, 255).astype(np.uint8))
    return folder


def sceneflow(folder: Path, sequence: str = "TRAIN/A/0000", number: str = "0006") -> Path:
    for view, side in enumerate(("left", "right")):
        _write(folder / "frames_cleanpass" / sequence / side / f"{number}.png", WORLD.view(view))
    place = folder / "disparity" / sequence / "left"
    place.mkdir(parents=True, exist_ok=True)
    (place / f"{number}.pfm").write_bytes(pfm_bytes(truth()))
    return folder
