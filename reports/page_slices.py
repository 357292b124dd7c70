"""Epipolar slices on the page, in columns of the reference view: similarity, materiality and visibility."""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.measures.volumes import StoredVolume
from matbench.recording.reduction import as_bytes
from matbench.scene import Scene
from matbench.space import Volume, visibility

PLANES = 96
"""The most planes that a slice of similarity has."""

SPREAD = 10.0  # grey levels: at this difference the similarity is exp(-1/2)
_ROWS, _COLUMNS = 1, 2  # how far the window reaches from its middle


@frozen(eq=False)
class PageSlice:
    """One epipolar plane as a picture, the nearest disparity on top.

    Parameters
    ----------
    values
        (planes, W) uint8, 255 is 1; columns are the reference view's pixels.
    ends
        Disparities of the lower and the upper edge, pixels per view step.
    """

    values: NDArray[np.uint8]
    ends: tuple[float, float]


def rows_of(scene: Scene, asked: Sequence[int]) -> list[int]:
    """The rows shown: those asked for, the middle one, and those a quarter of the height above and below it."""
    wanted = [min(max(row, 0), scene.height - 1) for row in asked]
    return list(dict.fromkeys([*wanted, scene.height // 2, scene.height // 4, 3 * scene.height // 4]))


def similarity(scene: Scene, row: int) -> PageSlice:
    """Similarity of neighbouring views at each disparity of a row. It is for looking at; no method uses it.

    exp(-SSD / (2 `SPREAD`²)), where SSD is the mean squared difference of colours in a window of 3 rows and 5
    columns. It is averaged over the pairs of neighbouring views that both have the point in their frame, and
    0 where there is no such pair.
    """
    least, largest = scene.disparities.least, scene.disparities.largest
    count = int(np.clip(np.ceil((largest - least) * scene.pair_steps) + 1, 2, PLANES))
    planes = np.linspace(largest, least, count, dtype=np.float32)
    columns = np.arange(scene.width, dtype=np.float32)
    rows = slice(max(0, row - _ROWS), row + _ROWS + 1)
    total, pairs = np.zeros((count, scene.width)), np.zeros((count, scene.width))
    before: tuple[NDArray[Any], NDArray[Any]] | None = None
    for view in range(scene.n):
        places = columns - np.float32(scene.steps(view)) * planes[:, None]
        inside = (places >= 0) & (places <= scene.width - 1)
        here = np.stack([_sampled(line, places) for line in scene.views[view, rows].astype(np.float32)]), inside
        if before is not None:
            square = np.mean((here[0] - before[0]) ** 2, axis=(0, 3))
            both = inside & before[1]
            total += both * np.exp(cv2.blur(square, (2 * _COLUMNS + 1, 1)) / (-2 * SPREAD**2))
            pairs += both
        before = here
    half = (largest - least) / (count - 1) / 2 if largest > least else 0.5
    return PageSlice(as_bytes(total / np.maximum(pairs, 1)), (least - half, largest + half))


def _sampled(line: NDArray[np.float32], places: NDArray[np.float32]) -> NDArray[np.float32]:
    """(W, 3) colours of an image row at (planes, W) columns, linear between pixels -> (planes, W, 3)."""
    sampled = cv2.remap(line[None], places, np.zeros_like(places), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(sampled, np.float32)


def materiality(stored: StoredVolume, scene: Scene, row: int) -> tuple[PageSlice, PageSlice] | None:
    """Materiality in a row of a volume, and visibility: the mean over its views (equation 3 of the paper).

    None if the volume does not cover the reference view or the row.
    """
    if scene.ref not in stored.views or not 0 <= row < stored.space.rows or stored.space.width != scene.width:
        return None
    space, ref = evolve(stored.space, rows=1), stored.views.index(scene.ref)
    volume = Volume(space, stored.levels[row : row + 1] * np.float32(1 / 255), stored.views)
    seen = np.mean([visibility(volume, view) for view in range(space.views)], axis=0)
    step = (stored.views[1] - stored.views[0]) * space.fineness  # samples to a pixel per view step of the scene
    ends = (space.first - 0.5) / step, (space.last + 0.5) / step
    material, sight = (space.in_view(v, ref)[0, ::-1].astype(np.float32) for v in (volume.values, seen))
    return PageSlice(as_bytes(material), ends), PageSlice(as_bytes(sight), ends)
