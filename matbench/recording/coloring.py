"""Disparity and error maps as coloured pictures, the same in recordings and on the report page.

All maps of a scene share one scale of perceptually uniform colours. Pixels without an answer are striped.
Pixels of unknown truth are grey; neither colour map contains grey.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from matbench import drawing
from matbench.measures.metrics import error_map
from matbench.scene import Scene

DISPARITY, ERROR, DIFFERENCE = "viridis", "magma", "PuOr"
WORST = 4.0  # px of the pair: errors from here on have the last colour
UNKNOWN = 128  # grey of unknown truth
STRIPES = (196, 250)  # two greys: a pattern, unlike a colour, is told apart by colour-blind readers, too

Picture = NDArray[np.uint8]
"""(H, W, 3) RGB."""


@cache
def palette(name: str, levels: int = 256) -> NDArray[np.uint8]:
    """(levels, 3) RGB of one of matplotlib's colour maps."""
    table = np.rint(255 * drawing.load().colormaps[name](np.linspace(0, 1, levels))[:, :3])
    return np.asarray(table, np.uint8)


def stripes(rows: int, columns: int) -> Picture:
    """Diagonal stripes, about 36 across the longer side."""
    period = max(4, max(rows, columns) // 36)
    light = (np.add.outer(np.arange(rows), np.arange(columns)) % period) * 2 >= period
    return np.repeat(np.where(light, STRIPES[1], STRIPES[0]).astype(np.uint8)[:, :, None], 3, axis=2)


def colors(values: NDArray[np.floating], ends: tuple[float, float], name: str, levels: int = 256) -> Picture:
    """(H, W) numbers as colours between two ends; what is not finite is striped.

    Fewer `levels` make smaller files; no eye tells 128 from 256.
    """
    known = np.isfinite(values)
    steps = (levels - 1) / (ends[1] - ends[0]) if ends[1] > ends[0] else 0.0
    picture = stripes(*values.shape)
    index = np.clip(np.rint((values[known] - ends[0]) * steps), 0, levels - 1).astype(np.intp)
    picture[known] = palette(name, levels)[index]
    return picture


def disparity_ends(scene: Scene) -> tuple[float, float]:
    """The disparities of the first and the last colour in all maps of a scene, pixels per view step.

    The least and the largest true disparity of the reference view; without truth, the range to search.
    They are never equal.
    """
    truth = scene.truth.get(scene.ref)
    least, largest = scene.disparities.least, scene.disparities.largest
    if truth is not None and np.isfinite(truth).any():
        least, largest = float(np.nanmin(truth)), float(np.nanmax(truth))
    return (least, largest) if largest > least else (least - 0.5, least + 0.5)


def disparity_colors(disparity: NDArray[np.floating], ends: tuple[float, float], levels: int = 256) -> Picture:
    """A method's map as a picture: far is dark blue, near is yellow, no answer is striped."""
    return colors(disparity, ends, DISPARITY, levels)


def truth_colors(truth: NDArray[np.floating], ends: tuple[float, float], levels: int = 256) -> Picture:
    """A true map in the colours of `disparity_colors`; grey where the truth is unknown."""
    picture = colors(truth, ends, DISPARITY, levels)
    picture[~np.isfinite(truth)] = UNKNOWN
    return picture


def picture_colors(values: NDArray[np.floating], most: float, is_signed: bool, levels: int = 256) -> Picture:
    """A metric's picture, from 0 or, if it is signed, from ``-most`` to `most`; grey where there is nothing to show."""
    ends = (-most if is_signed else 0.0, most)
    picture = colors(values, ends, DIFFERENCE if is_signed else ERROR, levels)
    picture[~np.isfinite(values)] = UNKNOWN
    return picture


def error_colors(
    estimate: NDArray[np.float32], truth: NDArray[np.float32], pair_steps: float, levels: int = 256
) -> Picture:
    """The errors as a picture, from 0 to `WORST` px of the pair; no answer is striped, unknown truth is grey."""
    picture = colors(error_map(estimate, truth, pair_steps), (0.0, WORST), ERROR, levels)
    picture[~np.isfinite(truth)] = UNKNOWN
    return picture
