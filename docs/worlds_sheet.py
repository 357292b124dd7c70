"""Draw docs/images/worlds.jpg: the worlds of `worlds/quick`, the reference view of each above its true disparities.

python docs/worlds_sheet.py
"""

from pathlib import Path

import cv2
import matplotlib
import numpy as np

import matbench
from matbench.scenes.catalogue import sets

COLUMNS, GAP = 6, 4
PLACE = Path(__file__).parent / "images" / "worlds.jpg"


def tile(name: str) -> np.ndarray:
    """(H, W, 3) RGB: a world's reference view, and below it its truth, from far (dark) to near."""
    scene = matbench.load_scene(name)
    truth = scene.truth[scene.ref]
    share = (truth - np.nanmin(truth)) / max(np.nanmax(truth) - np.nanmin(truth), 1e-6)
    near = (255 * matplotlib.colormaps["inferno"](share)[..., :3]).astype(np.uint8)
    return np.vstack([scene.views[scene.ref], near])


def main() -> None:
    tiles = [np.pad(tile(name), ((0, GAP), (0, GAP), (0, 0)), constant_values=255) for name in sets()["worlds/quick"]]
    rows = [np.hstack(tiles[start : start + COLUMNS]) for start in range(0, len(tiles), COLUMNS)]
    sheet = np.vstack(rows)[:-GAP, :-GAP]
    cv2.imwrite(str(PLACE), cv2.cvtColor(sheet, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 88])


if __name__ == "__main__":
    main()
