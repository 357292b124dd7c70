"""Volumes and maps as bounded arrays of bytes: what recordings and figures show.

Nothing here knows the viewer.
"""

from math import ceil

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.space import DisparitySpace, Volume, visibility

VOLUME_BYTES = 3 * 2**19  # one recorded volume: 1.5 MiB
SLICE_PIXELS = 150_000


def step_within(height: int, width: int, pixels: int) -> int:
    """The least k such that every k-th row and column are at most `pixels`."""
    step = 1
    while ceil(height / step) * ceil(width / step) > pixels:
        step += 1
    return step


def thinned(values: NDArray[np.float32], pixels: int) -> NDArray[np.float32]:
    """Every k-th row and column of a map, at most `pixels`."""
    step = step_within(values.shape[0], values.shape[1], pixels)
    return values[::step, ::step]


def as_bytes(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Numbers in [0, 1] as 0..255; NaN is 0."""
    scaled: NDArray[np.uint8] = np.rint(np.clip(np.nan_to_num(values), 0, 1) * 255).astype(np.uint8)
    return scaled


def upright(planes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An epipolar slice as a picture: the farthest plane at the bottom, planes thick enough to see.

    Disparity grows upward, as in the paper's figure 2; columns are those of view 0, outside its
    frame included.

    Parameters
    ----------
    planes
        (planes, columns) or (planes, columns, 3), far to near.

    Returns
    -------
    (planes * k, columns[, 3]), where k makes the picture about three times as wide as high. If it
    were larger than `SLICE_PIXELS`, only every m-th column is kept.
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
    """A volume small enough to be kept: every k-th row and column, thick planes, as bytes.

    Parameters
    ----------
    space
        The target points that it was taken from.
    values
        (rows, planes, columns) uint8. Values are exact at the kept rows and columns, not blended;
        planes, if they had to be joined, keep their largest value.
    first_row
        The first kept row; the row shown in slices is always among the kept ones.
    steps
        How many rows, planes and columns of the space one element stands for.
    """

    space: DisparitySpace
    values: NDArray[np.uint8]
    first_row: int
    steps: tuple[int, int, int]


def steps_within(space: DisparitySpace, limit: int) -> tuple[int, int, int]:
    """Steps along (rows, planes, columns) with which a volume has at most `limit` elements.

    Rows and columns are thinned evenly in pixels; planes, which carry the result, four times later.
    """
    steps = [1, 1, 1]
    finest = (1.0, 4.0 / space.fineness, 1.0 / space.fineness)
    while np.prod([ceil(size / step) for size, step in zip(space.shape, steps, strict=True)]) > limit:
        # an axis down to one element has nothing left to give
        left = [axis for axis in range(3) if steps[axis] < space.shape[axis]]
        steps[min(left, key=lambda axis: steps[axis] * finest[axis])] += 1
    return steps[0], steps[1], steps[2]


def reduce_volume(volume: Volume, row: int, view: int | None = None, limit: int = VOLUME_BYTES) -> ReducedVolume:
    """A volume, or with `view` the visibility that follows from it there, as at most `limit` bytes.

    Row `row` is among the kept ones. Rows go first: epipolar planes stand alone, so that the
    visibilities of those that are kept are exact.
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
    """The same with every k-th row and column of it, at most `limit` bytes; row `row` is among them."""
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
