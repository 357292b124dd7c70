"""The geometry of disparity space drawn as a box: columns of view 0 to the right, rows down, far planes behind.

Pixel rays are straight lines in it, and the rays of one epipolar plane cross in the target points. Nothing
here depends on the viewer.
"""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.recording.coloring import disparity_colors
from matbench.recording.perspective import Eye, Point, from_the_side
from matbench.recording.reduction import ReducedVolume
from matbench.space import DisparitySpace

GAMMA = 2.0
"""Values of a dense volume are raised to this power: else the haze of many small values would hide the large ones."""

THROUGH_ALL = 3.0  # optical depth across a dense volume, on average


def _depth(space: DisparitySpace, plane: float) -> float:
    """Depth at which a plane's far side is drawn; the whole box is half as deep as the image is wide."""
    return (space.planes - plane) / space.planes * space.width / 2


@frozen(eq=False)
class Voxels:
    """Elements of a volume as boxes in disparity space.

    Parameters
    ----------
    indices
        (N, 3), along columns, rows and planes; the nearest plane is 0, towards the eye.
    colors
        (N, 3) uint8: the colour of the plane's disparity, as in a map.
    size, origin
        Size of an element, and the corner of the first one: columns of view 0 and rows in pixels.
    """

    indices: NDArray[np.int32]
    colors: NDArray[np.uint8]
    size: Point
    origin: Point


def voxels(volume: ReducedVolume, least: float, limit: int, ends: tuple[float, float]) -> Voxels:
    """The elements whose value is at least `least`; if more than `limit`, those with the largest values.

    `ends` are the disparities of the first and the last colour (`coloring.disparity_ends`).
    """
    y, k, x = np.nonzero(volume.values >= max(1, round(255 * least)))
    if len(y) > limit:
        chosen = np.sort(np.argsort(volume.values[y, k, x], kind="stable")[-limit:])
        y, k, x = y[chosen], k[chosen], x[chosen]
    space, planes = volume.space, volume.values.shape[1]
    return Voxels(
        np.stack([x, y, planes - 1 - k], axis=1).astype(np.int32),
        disparity_colors(space.disparities[None, :: volume.steps[1]], ends)[0, k],
        *_grid(volume),
    )


def frustum(space: DisparitySpace, view: int, row: int) -> list[Point]:
    """The closed outline of what a view sees of an epipolar plane, in the coordinates of `Voxels`."""
    outline = []
    for plane, end in ((0, 0), (0, 1), (space.planes - 1, 1), (space.planes - 1, 0), (0, 0)):
        column = (space.start(view, plane) + space.origin) / space.fineness + end * space.width
        outline.append((column, row + 0.5, _depth(space, plane + 0.5)))
    return outline


def plane(space: DisparitySpace, number: int) -> list[Point]:
    """The closed outline of one plane of target points."""
    left, right = space.origin / space.fineness, (space.origin + space.columns) / space.fineness
    z, bottom = _depth(space, number + 0.5), float(space.rows)
    return [(left, 0.0, z), (right, 0.0, z), (right, bottom, z), (left, bottom, z), (left, 0.0, z)]


def ray(space: DisparitySpace, view: int, row: int, sample: int) -> list[Point]:
    """The ray of one sample of a view, from the nearest plane to the farthest."""
    ends = []
    for number in (space.planes - 1, 0):
        column = (space.start(view, number) + space.origin + sample + 0.5) / space.fineness
        ends.append((column, row + 0.5, _depth(space, number + 0.5)))
    return ends


def target(space: DisparitySpace, view: int, sample: int, number: int) -> tuple[int, tuple[int, ...]]:
    """The target point on a view's sample and a plane: its column, and the sample of every view that meets it.

    Source: equation 1 of the paper.
    """
    column = space.start(view, number) + sample
    return column, tuple(column - space.start(other, number) for other in range(space.views))


@frozen(eq=False)
class Dense:
    """A volume as a field, which the viewer draws by marching rays through it.

    Parameters
    ----------
    values
        (planes, rows, columns) float16 in [0, 1], the nearest plane first.
    size, origin
        Size of an element, and the corner of the first one, as in `Voxels`.
    depth
        Optical depth across an axis full of ones. It is chosen so that every volume is equally dense on average:
        else a surface, one or two planes thick, would hardly be seen, and a full volume would hide everything.
    """

    values: NDArray[np.float16]
    size: Point
    origin: Point
    depth: float


def dense(volume: ReducedVolume) -> Dense:
    """All elements of a volume, as a field in disparity space."""
    values = volume.values.transpose(1, 0, 2)[::-1].astype(np.float16) / np.float16(255)
    filled = float(np.mean(values.astype(np.float32) ** GAMMA))
    return Dense(values, *_grid(volume), THROUGH_ALL / max(filled, 0.5 / len(values)))


def _grid(volume: ReducedVolume) -> tuple[Point, Point]:
    """The size of an element and the corner of the first one."""
    space, (rows, thick, columns) = volume.space, volume.steps
    size = (columns / space.fineness, float(rows), _depth(space, space.planes - thick))
    return size, (space.origin / space.fineness, float(volume.first_row), 0.0)


def eye_on(space: DisparitySpace) -> Eye:
    """The eye that sees all of a space."""
    left, right = space.origin / space.fineness, (space.origin + space.columns) / space.fineness
    # seen whole in a panel twice as wide as high
    distance = max(space.rows, (right - left) / 2) + 0.15 * space.width
    return from_the_side(np.array([(left + right) / 2, space.rows / 2, space.width / 4]), distance)
