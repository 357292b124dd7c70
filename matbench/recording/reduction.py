"""Volumes and maps reduced to a bounded number of bytes, for recordings and figures.

Nothing here depends on the viewer.
"""

from math import ceil

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.space import DisparitySpace, Volume, visibility

VOLUME_BYTES = 3 * 2**19  # one recorded volume: 1.5 MiB
SLICE_PIXELS = 150_000  # one slice


def step_within(height: int, width: int, pixels: int) -> int:
    """The least k such that every k-th row and column together have at most `pixels` pixels."""
    step = 1
    while ceil(height / step) * ceil(width / step) > pixels:
        step += 1
    return step


def thinned(values: NDArray[np.float32], pixels: int) -> NDArray[np.float32]:
    """Every k-th row and column of a map, at most `pixels` in all. Blending would invent disparities at edges."""
    step = step_within(values.shape[0], values.shape[1], pixels)
    return values[::step, ::step]


def as_bytes(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Numbers in [0, 1] as 0..255; NaN is 0."""
    scaled: NDArray[np.uint8] = np.rint(np.clip(np.nan_to_num(values), 0, 1) * 255).astype(np.uint8)
    return scaled


def upright(planes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An epipolar slice as a picture: the farthest plane at the bottom, planes repeated until they can be seen.

    Disparity grows upward, as in the paper's figure 2; columns are those of view 0, outside its
    frame included.

    Parameters
    ----------
    planes
        (planes, columns) or (planes, columns, 3), far to near.

    Returns
    -------
    (planes * k, columns[, 3]), where k makes the picture about three times as wide as high. If that is
    larger than `SLICE_PIXELS`, only every m-th column is kept.
    """
    height, width = planes.shape[:2]
    kept = planes[::-1, :: ceil(height * width / SLICE_PIXELS)]
    thick = max(1, min(round(kept.shape[1] / (3 * height)), SLICE_PIXELS // (height * kept.shape[1]), 16))
    return np.ascontiguousarray(np.repeat(kept, thick, axis=0))


def sign_colors(derivative: NDArray[np.integer]) -> NDArray[np.uint8]:
    """(planes, columns, 3): red where negative (materiality wants to grow), blue positive, black zero."""
    picture = np.zeros((*derivative.shape, 3), np.uint8)
    picture[derivative < 0, 0] = 255
    picture[derivative > 0, 2] = 255
    return picture


@frozen(eq=False)
class ReducedVolume:
    """A volume made small enough to store: every k-th row and column, planes joined, as bytes.

    Parameters
    ----------
    space
        The disparity space of the whole volume.
    values
        (rows, planes, columns) uint8. Values at the kept rows and columns are exact, not blended.
        Planes that were joined keep their largest value: else a thin surface would vanish.
    first_row
        The first kept row. The row that slices show is always kept.
    steps
        How many rows, planes and columns of the space one element stands for.
    """

    space: DisparitySpace
    values: NDArray[np.uint8]
    first_row: int
    steps: tuple[int, int, int]


def steps_within(space: DisparitySpace, limit: int) -> tuple[int, int, int]:
    """Steps along (rows, planes, columns) with which a volume has at most `limit` elements.

    Rows and columns get equal steps in pixels. Planes carry the result: their step grows four times later.
    """
    steps = [1, 1, 1]
    finest = (1.0, 4.0 / space.fineness, 1.0 / space.fineness)
    while np.prod([ceil(size / step) for size, step in zip(space.shape, steps, strict=True)]) > limit:
        # an axis with one element left cannot shrink further
        left = [axis for axis in range(3) if steps[axis] < space.shape[axis]]
        steps[min(left, key=lambda axis: steps[axis] * finest[axis])] += 1
    return steps[0], steps[1], steps[2]


def reduce_volume(volume: Volume, row: int, view: int | None = None, limit: int = VOLUME_BYTES) -> ReducedVolume:
    """A volume in at most `limit` bytes; with `view`, the visibility in that view instead.

    Row `row` is kept. Rows are dropped before visibility is computed, columns and planes after it: epipolar
    planes do not depend on each other, so the visibility in the kept rows is exact.
    """
    space, steps = volume.space, steps_within(volume.space, limit)
    first = row % steps[0]
    values = volume.values[first :: steps[0]]
    if view is not None:
        values = visibility(Volume(evolve(space, rows=len(values)), values, volume.views), view)
    values = values[:, :, :: steps[2]]
    if steps[1] > 1:
        values = np.maximum.reduceat(values, np.arange(0, values.shape[1], steps[1]), axis=1)
    return ReducedVolume(space, as_bytes(values), first, steps)


def coarser(volume: ReducedVolume, row: int, limit: int) -> ReducedVolume:
    """A reduced volume reduced further, to at most `limit` bytes: every k-th row and column; row `row` is kept."""
    rows, planes, columns = volume.values.shape
    step = 1
    while ceil(rows / step) * planes * ceil(columns / step) > limit and step < max(rows, columns):
        step += 1
    thick, first = volume.steps, (row - volume.first_row) // volume.steps[0] % step
    return ReducedVolume(
        volume.space,
        volume.values[first::step, :, ::step],
        volume.first_row + first * thick[0],
        (thick[0] * step, thick[1], thick[2] * step),
    )
