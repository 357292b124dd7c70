"""Volumes and surfaces as bounded arrays of bytes and points: what recordings show.

Nothing here knows the viewer.
"""

from math import ceil

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.coloring import disparity_colors
from matbench.scene import Scene
from matbench.space import DisparitySpace, Volume, visibility

VOLUME_BYTES = 3 * 2**19  # one recorded volume: 1.5 MiB
SLICE_PIXELS = 150_000
DEEPEST = 6.0  # farthest depth over nearest depth of a drawn range of disparities

Eye = tuple[tuple[float, float, float], tuple[float, float, float]]  # position and target


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
class Reduced:
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


def reduced(volume: Volume, row: int, view: int | None = None, limit: int = VOLUME_BYTES) -> Reduced:
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
    return Reduced(space, as_bytes(values), first, steps)


@frozen(eq=False)
class Perspective:
    """Where disparities lie in space, up to scale; x right, y down, z away from the camera.

    Depth is inverse to disparity, ``z = (largest + offset) / (d + offset)``, with the nearest
    disparity of the scene's range at depth 1. The offset is 0 wherever the range allows it: true
    perspective up to the unknown focal length (drawn as the image's width). Where the range comes
    near 0 or below, whose depth is infinite or undefined, the offset is the least that leaves the
    farthest depth at `DEEPEST`; it bends no plane, for adding to a disparity is a projective map.
    """

    scene: Scene
    offset: float

    @classmethod
    def of(cls, scene: Scene) -> "Perspective":
        least, largest = scene.disparities.least, scene.disparities.largest
        offset = max(0.0, (largest - DEEPEST * least) / (DEEPEST - 1))
        return cls(scene, offset if least + offset > 0 else 1.0 - least)

    @property
    def baseline(self) -> float:
        """The distance between neighbouring views."""
        return (self.scene.disparities.largest + self.offset) / self.scene.width

    def surface(
        self, disparity: NDArray[np.float32], limit: int
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.float32]]:
        """Points (N, 3), colours (N, 3) and radii (N,) of a reference view's map, one per finite pixel.

        With more than `limit` pixels, every k-th row and column; a radius closes the gap to the
        neighbouring pixel.
        """
        scene, picture = self.scene, self.scene.views[self.scene.ref]
        step = step_within(disparity.shape[0], disparity.shape[1], limit)
        y, x = step * np.stack(np.nonzero(np.isfinite(disparity[::step, ::step])))
        d = disparity[y, x]
        nearest = scene.disparities.largest + self.offset
        farthest = scene.disparities.least + self.offset
        depth = nearest / np.maximum(d + self.offset, farthest / 2)  # an answer below the range stays in sight
        across, down = (x - (scene.width - 1) / 2) / scene.width, (y - (scene.height - 1) / 2) / scene.width
        points = np.stack([across * depth, down * depth, depth], axis=1).astype(np.float32)
        return points, picture[y, x], (0.9 * step * depth / scene.width).astype(np.float32)

    def eye(self, points: NDArray[np.float32]) -> Eye | None:
        """Where to look from: the reference view, a little from the right and above."""
        if not len(points):
            return None
        # from the reference view itself all points are in sight; a step aside shows their depth
        depth = float(np.median(points[:, 2]))
        return _from_the_side(np.array([0, 0, depth]), 1.1 * depth)


def _from_the_side(target: NDArray[np.floating], distance: float) -> Eye:
    """The eye at a distance before a point, a little from the right and above (x right, y down)."""
    towards = np.array([0.4, -0.3, -1.0])
    x, y, z = (target + towards / np.linalg.norm(towards) * distance).tolist()
    a, b, c = target.tolist()
    return (x, y, z), (a, b, c)


def _depth(space: DisparitySpace, plane: float) -> float:
    """Where a plane's far side is drawn in disparity space: the whole is half as deep as the image is wide."""
    return (space.planes - plane) / space.planes * space.width / 2


@frozen(eq=False)
class Voxels:
    """Elements of a volume where they are in disparity space.

    Parameters
    ----------
    indices
        (N, 3), along columns, rows and planes; the nearest plane is 0, towards the eye.
    colors
        (N, 3): the plane's colour, as in a disparity map.
    size, origin
        Of an element, and the corner of the first: columns of view 0 and rows in pixels.
    """

    indices: NDArray[np.int32]
    colors: NDArray[np.uint8]
    size: tuple[float, float, float]
    origin: tuple[float, float, float]


def voxels(volume: Reduced, least: float, limit: int, ends: tuple[float, float]) -> Voxels:
    """The elements of at least `least`; with more than `limit`, those of the largest values.

    `ends` are those of the colours of disparities.
    """
    y, k, x = np.nonzero(volume.values >= max(1, round(255 * least)))
    if len(y) > limit:
        chosen = np.sort(np.argsort(volume.values[y, k, x], kind="stable")[-limit:])
        y, k, x = y[chosen], k[chosen], x[chosen]
    space, planes = volume.space, volume.values.shape[1]
    rows, thick, columns = volume.steps
    return Voxels(
        np.stack([x, y, planes - 1 - k], axis=1).astype(np.int32),
        disparity_colors(space.disparities[None, ::thick], ends)[0, k],
        (columns / space.fineness, float(rows), _depth(space, space.planes - thick)),
        (space.origin / space.fineness, float(volume.first_row), 0.0),
    )


def frustum(space: DisparitySpace, view: int, row: int) -> list[tuple[float, float, float]]:
    """The closed outline of what a view sees of an epipolar plane, drawn as `voxels` are."""
    outline = []
    for plane, end in ((0, 0), (0, 1), (space.planes - 1, 1), (space.planes - 1, 0), (0, 0)):
        column = (space.start(view, plane) + space.origin) / space.fineness + end * space.width
        outline.append((column, row + 0.5, _depth(space, plane + 0.5)))
    return outline


def eye_on(space: DisparitySpace) -> Eye:
    """Where to look from to see all of a space."""
    left, right = space.origin / space.fineness, (space.origin + space.columns) / space.fineness
    # seen whole in a panel twice as wide as high
    distance = max(space.rows, (right - left) / 2) + 0.15 * space.width
    return _from_the_side(np.array([(left + right) / 2, space.rows / 2, space.width / 4]), distance)
