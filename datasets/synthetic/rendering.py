"""Casting rays into a world of simple surfaces, seen by evenly spaced pinhole cameras.

Only sums, products, quotients and square roots of float64 are computed, in a fixed order. Therefore the
pictures are the same on every machine.
"""

from collections.abc import Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.datasets.synthetic.surfaces import LIGHT, Array, Point, Surface, Vector
from matbench.datasets.synthetic.textures import lookup

_BLOCK = 30  # rows rendered at a time: what they need stays in the cache
_BEHIND = 1e-7  # relative depth by which a point must lie behind another to be hidden by it
_MARGIN = 1e-6  # slope by which a surface's window is widened: rounding must not cut off its edge
_POLISH = 5  # how often the cosine of a highlight is squared: its power is 2**5


@frozen
class Rig:
    """Evenly spaced cameras in front of one world, which must fill every picture.

    Each camera is ``baseline`` to the right of its left neighbour, and its sensor is shifted. The
    disparity of a point at depth Z is exactly ``focal * baseline / Z - offset`` px per view step.

    Parameters
    ----------
    surfaces
        The world.
    count
        How many cameras; the middle of the row is at X = 0.
    width, height
        Size of a picture, px.
    focal
        Focal length, px.
    baseline
        World units between neighbours.
    offset
        Shift of the sensors, px per view step.
    lowered
        How far the picture of each camera lies too low, px; all 0 if empty.
    highlight
        Grey levels that surfaces add where they reflect the light to the camera. Nothing else about a
        surface changes with the camera.
    """

    surfaces: Sequence[Surface] = field()
    count: int
    width: int
    height: int
    focal: float
    baseline: float
    offset: float = 0.0
    lowered: Sequence[float] = ()
    highlight: float = 0.0

    def disparity(self, depth: Array) -> Array:
        return self.focal * self.baseline / depth - self.offset

    def _lowered(self, view: int) -> float:
        return self.lowered[view] if self.lowered else 0.0

    def _rays(self, view: int, columns: Array, rows: Array) -> tuple[float, Array, Array]:
        """X of the camera, and the slopes to the right and down of the rays through places in its picture."""
        steps = view - (self.count - 1) / 2
        middle = (self.width - 1) / 2 + steps * self.offset
        top = rows - self._lowered(view)
        return steps * self.baseline, (columns - middle) / self.focal, (top - (self.height - 1) / 2) / self.focal

    def cast(self, view: int, columns: Array, rows: Array) -> tuple[Array, NDArray[np.intp]]:
        """Depth of the nearest surface on each ray, and the index of that surface, both (H, W).

        Rays go through columns and rows of the picture, px. Rows are (H, 1); columns are (1, W) or (H, W).
        """
        eye, right, down = self._rays(view, columns, rows)
        shape = np.broadcast_shapes(right.shape, down.shape)
        nearest, index = np.full(shape, np.inf), np.zeros(shape, np.intp)
        leftmost, rightmost = right.min(axis=0), right.max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):  # rays along a plane
            for number, surface in enumerate(self.surfaces):
                left, end, top, bottom = surface.window(eye)
                wide = _span((rightmost > left - _MARGIN) & (leftmost < end + _MARGIN))
                tall = _span((down[:, 0] > top - _MARGIN) & (down[:, 0] < bottom + _MARGIN))
                part = nearest[tall, wide]
                if part.size == 0:
                    continue
                depth = surface.depth(eye, right[tall if len(right) > 1 else slice(None), wide], down[tall])
                index[tall, wide][depth < part] = number
                np.minimum(part, depth, out=part)
        return nearest, index

    def _pixels(self) -> tuple[Array, Array]:
        return np.arange(self.width, dtype=float)[None, :], np.arange(self.height, dtype=float)[:, None]

    def depth(self, view: int, fineness: int = 1) -> Array:
        """(H, fineness (W - 1) + 1) depth on the rays through samples 1 / fineness px apart, pixel centres included."""
        columns, rows = self._pixels()
        if fineness > 1:
            columns = np.arange(fineness * (self.width - 1) + 1)[None, :] / fineness
        return self.cast(view, columns, rows)[0]

    def truth(self, view: int) -> Array:
        """(H, W) exact disparity of every pixel's centre, px per view step."""
        return self.disparity(self.depth(view))

    def visible(self, view: int, depth: Array | None = None) -> NDArray[np.bool_]:
        """(n, H, W) bool: does view j see the point that `view` sees at the centre of a pixel?

        The point is projected to its exact place in view j, and a ray is cast through that place.

        Parameters
        ----------
        depth
            The result of `depth` for `view`, if it is known already.
        """
        columns, rows = self._pixels()
        depth = self.depth(view) if depth is None else depth
        disparity = self.disparity(depth)
        seen = np.ones((self.count, self.height, self.width), bool)
        for other in range(self.count):
            if other != view:
                place, row = columns - (other - view) * disparity, rows + self._lowered(other) - self._lowered(view)
                first, _ = self.cast(other, place, row)
                framed = (place >= -0.5) & (place < self.width - 0.5) & (row >= -0.5) & (row < self.height - 0.5)
                seen[other] = framed & (first >= depth * (1 - _BEHIND))
        return seen

    def picture(self, view: int, pattern: NDArray[np.float32], samples: int = 3) -> NDArray[np.float32]:
        """(H, W, 3) RGB grey levels, every pixel the mean of samples x samples rays.

        Parameters
        ----------
        pattern
            (size, size, 3) float32 around 0, periodic. Each surface begins at another place of it.
        """
        columns, rows = self._pixels()
        shifts = [(k + 0.5) / samples - 0.5 for k in range(samples)]
        total = np.zeros((self.height, self.width, 3), np.float32)
        for first in range(0, self.height, _BLOCK):
            block = slice(first, first + _BLOCK)
            for down in shifts:
                for right in shifts:
                    total[block] += self._colours(view, columns + right, rows[block] + down, pattern)
        return total / np.float32(samples**2)

    def _colours(self, view: int, columns: Array, rows: Array, pattern: NDArray[np.float32]) -> NDArray[np.float32]:
        """(rows, columns, 3) colours that the rays meet."""
        depths, surfaces = self.cast(view, columns, rows)
        depth, index = depths.ravel(), surfaces.ravel()
        eye, right, down = self._rays(view, columns, rows)
        colours = np.empty((depth.size, 3), np.float32)
        for number in map(int, np.flatnonzero(np.bincount(index))):
            surface = self.surfaces[number]
            mine = np.flatnonzero(index == number)
            row, column = np.divmod(mine, self.width)
            z = depth[mine]
            point = (eye + z * right[0, column], z * down[row, 0], z)
            paint, (a, b) = surface.paint, surface.coordinates(point)
            across, along = paint.place or (0.37 * number, 0.61 * number)
            relief = lookup(pattern, a / paint.scale + across, b / paint.scale + along)
            colour = np.float32(paint.contrast) * relief + np.asarray(paint.colour, np.float32)
            colour *= np.reshape(surface.shade(point), (-1, 1)).astype(np.float32)
            if self.highlight:
                shine = mirrored(surface.normal(point), (eye - point[0], -point[1], -z))
                colour += np.reshape(self.highlight * shine, (-1, 1)).astype(np.float32)
            colours[mine] = colour
        return colours.reshape(rows.size, columns.size, 3)


def _span(chosen: NDArray[np.bool_]) -> slice:
    """The slice from the first chosen element to the last; empty if there is none."""
    places = np.flatnonzero(chosen)
    return slice(int(places[0]), int(places[-1]) + 1) if places.size else slice(0)


def mirrored(normal: tuple[Array | float, Array | float, Array | float], eye: Point) -> Array:
    """Strength of a highlight, 0 to 1: a high power of the cosine between the normal and the half vector.

    The half vector lies midway between the directions to the light and to the camera (Blinn 1977,
    "Models of light reflection for computer synthesized pictures").

    Parameters
    ----------
    normal
        Unit normals of the points.
    eye
        Vectors from the points to the camera, of any length.
    """
    length = np.sqrt(eye[0] * eye[0] + eye[1] * eye[1] + eye[2] * eye[2])
    half: Vector | Point = tuple(a / length + b for a, b in zip(eye, LIGHT, strict=True))  # type: ignore[assignment]
    size = np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    cosine = np.maximum((normal[0] * half[0] + normal[1] * half[1] + normal[2] * half[2]) / size, 0.0)
    for _ in range(_POLISH):
        cosine = cosine * cosine
    share: Array = cosine
    return share
