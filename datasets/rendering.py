"""Casting rays into a world of simple surfaces, seen by evenly spaced pinhole cameras.

World axes: X to the right, Y down, Z away from the cameras, which stand at Y = Z = 0 and look
along Z. All that is computed is sums, products, quotients and square roots of float64, in a fixed
order: the pictures are the same on every machine.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

LIGHT: Vector = (-0.48, -0.6, -0.64)
"""Unit vector towards the light: from the upper left, behind the cameras."""

_AMBIENT = 0.45
_BLOCK = 30  # rows rendered at a time: what they need stays in the cache
_BEHIND = 1e-7  # relative depth by which a point must lie behind another to be hidden by it


@frozen
class Paint:
    """A colour with a random pattern on it.

    Parameters
    ----------
    colour
        RGB grey levels of its middle.
    contrast
        Grey levels of the pattern's standard deviation.
    scale
        World units of the pattern's period.
    """

    colour: Vector
    contrast: float
    scale: float


class Surface(Protocol):
    """What a ray can meet."""

    @property
    def paint(self) -> Paint: ...

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        """Depth Z at which the rays (eye, 0, 0) + Z (right, down, 1) meet it; infinite if they do not."""
        ...

    def coordinates(self, point: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        """Two coordinates on the surface, world units, and with them the pattern's place."""
        ...

    def shade(self, point: tuple[Array, Array, Array]) -> Array | float:
        """Share of the light that it returns: Lambert's cosine law, the same for every camera."""
        ...


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@frozen
class Rectangle:
    """A parallelogram: a corner and two edges."""

    corner: Vector
    along: Vector
    across: Vector
    paint: Paint

    @property
    def normal(self) -> Vector:
        (a, b, c), (d, e, f) = self.along, self.across
        return b * f - c * e, c * d - a * f, a * e - b * d

    def _place(self, x: Array, y: Array, z: Array) -> tuple[Array, Array]:
        """Shares of the two edges, 0 to 1 inside."""
        p, (u, v) = self.corner, (self.along, self.across)
        uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
        det = uu * vv - uv * uv
        dual_u = tuple((vv * a - uv * b) / det for a, b in zip(u, v, strict=True))
        dual_v = tuple((uu * b - uv * a) / det for a, b in zip(u, v, strict=True))
        dx, dy, dz = x - p[0], y - p[1], z - p[2]
        return (
            dual_u[0] * dx + dual_u[1] * dy + dual_u[2] * dz,
            dual_v[0] * dx + dual_v[1] * dy + dual_v[2] * dz,
        )

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        n, p = self.normal, self.corner
        z = (n[0] * (p[0] - eye) + n[1] * p[1] + n[2] * p[2]) / (n[0] * right + n[1] * down + n[2])
        a, b = self._place(eye + z * right, z * down, z)
        return np.where((z > 0) & (a >= 0) & (a <= 1) & (b >= 0) & (b <= 1), z, np.inf)

    def coordinates(self, point: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        a, b = self._place(*point)
        return a * float(np.sqrt(_dot(self.along, self.along))), b * float(np.sqrt(_dot(self.across, self.across)))

    def shade(self, point: tuple[Array, Array, Array]) -> float:
        n = self.normal
        facing = _dot(n, LIGHT) / float(np.sqrt(_dot(n, n)))
        towards_cameras = (
            -1.0 if n[0] * point[0].flat[0] + n[1] * point[1].flat[0] + n[2] * point[2].flat[0] > 0 else 1.0
        )
        return _AMBIENT + (1 - _AMBIENT) * max(0.0, towards_cameras * facing)


@frozen
class Sphere:
    """A ball."""

    centre: Vector
    radius: float
    paint: Paint

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        cx, cy, cz = self.centre[0] - eye, self.centre[1], self.centre[2]
        return _near_root(
            right * right + down * down + 1,
            cx * right + cy * down + cz,
            cx * cx + cy * cy + cz * cz - self.radius * self.radius,
        )

    def coordinates(self, point: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        # the pattern is carried onto it along Z: even, as seen from the front
        return point[0] - self.centre[0], point[1] - self.centre[1]

    def shade(self, point: tuple[Array, Array, Array]) -> Array:
        x, y, z = (a - c for a, c in zip(point, self.centre, strict=True))
        facing = (x * LIGHT[0] + y * LIGHT[1] + z * LIGHT[2]) / self.radius
        return _AMBIENT + (1 - _AMBIENT) * np.maximum(0.0, facing)


@frozen
class Column:
    """An upright cylinder without ends."""

    x: float
    z: float
    radius: float
    paint: Paint

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        cx = self.x - eye
        z = _near_root(right * right + 1, cx * right + self.z, cx * cx + self.z * self.z - self.radius * self.radius)
        return np.broadcast_to(z, np.broadcast_shapes(right.shape, down.shape))

    def coordinates(self, point: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        return point[0] - self.x, point[1]

    def shade(self, point: tuple[Array, Array, Array]) -> Array:
        facing = ((point[0] - self.x) * LIGHT[0] + (point[2] - self.z) * LIGHT[2]) / self.radius
        return _AMBIENT + (1 - _AMBIENT) * np.maximum(0.0, facing)


def _near_root(a: Array, b: Array, c: float) -> Array:
    """The smaller positive root of a z² - 2 b z + c; infinite where there is none."""
    inside = b * b - a * c
    z = (b - np.sqrt(np.maximum(inside, 0.0))) / a
    return np.where((inside > 0) & (z > 0), z, np.inf)


@frozen
class Rig:
    """Evenly spaced cameras with one world before them, which must fill every picture.

    A camera is ``baseline`` to the right of its left neighbour, and its sensor is shifted, so that
    the disparity of a point is exactly ``focal * baseline / Z - offset`` px per view step.

    Parameters
    ----------
    surfaces
        The world.
    count
        How many cameras; the middle of the row is at X = 0.
    width, height
        Of a picture, px.
    focal
        Focal length, px.
    baseline
        World units between neighbours.
    offset
        Px per view step that sensors are shifted.
    """

    surfaces: Sequence[Surface] = field()
    count: int
    width: int
    height: int
    focal: float
    baseline: float
    offset: float = 0.0

    def disparity(self, depth: Array) -> Array:
        return self.focal * self.baseline / depth - self.offset

    def _rays(self, view: int, columns: Array, rows: Array) -> tuple[float, Array, Array]:
        """Eye's X, and right and down of the rays through places in a picture, px."""
        steps = view - (self.count - 1) / 2
        middle = (self.width - 1) / 2 + steps * self.offset
        return steps * self.baseline, (columns - middle) / self.focal, (rows - (self.height - 1) / 2) / self.focal

    def cast(self, view: int, columns: Array, rows: Array) -> tuple[Array, NDArray[np.intp]]:
        """Depth and index of the nearest surface; columns and rows in px, broadcast against each other."""
        eye, right, down = self._rays(view, columns, rows)
        shape = np.broadcast_shapes(right.shape, down.shape)
        nearest, index = np.full(shape, np.inf), np.zeros(shape, np.intp)
        with np.errstate(divide="ignore", invalid="ignore"):  # rays along a plane
            for number, surface in enumerate(self.surfaces):
                depth = surface.depth(eye, right, down)
                index[depth < nearest] = number
                np.minimum(nearest, depth, out=nearest)
        return nearest, index

    def _pixels(self) -> tuple[Array, Array]:
        return np.arange(self.width, dtype=float)[None, :], np.arange(self.height, dtype=float)[:, None]

    def truth(self, view: int) -> Array:
        """(H, W) exact disparity of every pixel's centre, px per view step."""
        return self.disparity(self.cast(view, *self._pixels())[0])

    def visible(self, view: int) -> NDArray[np.bool_]:
        """(n, H, W): does view j see the point that `view` sees at the centre of a pixel?

        The point is projected to its exact place in view j, and a ray is cast through that.
        """
        columns, rows = self._pixels()
        depth, _ = self.cast(view, columns, rows)
        disparity = self.disparity(depth)
        seen = np.ones((self.count, self.height, self.width), bool)
        for other in range(self.count):
            if other != view:
                place = columns - (other - view) * disparity
                first, _ = self.cast(other, place, rows)
                seen[other] = (place >= -0.5) & (place < self.width - 0.5) & (first >= depth * (1 - _BEHIND))
        return seen

    def picture(self, view: int, pattern: NDArray[np.float32], samples: int = 3) -> NDArray[np.float32]:
        """(H, W, 3) RGB grey levels, every pixel the mean of samples x samples rays.

        Parameters
        ----------
        pattern
            (size, size, 3) float32 around 0, periodic; on every surface in its own place.
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
        for number, surface in enumerate(self.surfaces):
            mine = np.flatnonzero(index == number)
            if mine.size == 0:
                continue
            row, column = np.divmod(mine, self.width)
            z = depth[mine]
            point = (eye + z * right[0, column], z * down[row, 0], z)
            paint, (a, b) = surface.paint, surface.coordinates(point)
            relief = lookup(pattern, a / paint.scale + 0.37 * number, b / paint.scale + 0.61 * number)
            colour = np.float32(paint.contrast) * relief + np.asarray(paint.colour, np.float32)
            colours[mine] = colour * np.reshape(surface.shade(point), (-1, 1)).astype(np.float32)
        return colours.reshape(rows.size, columns.size, 3)


def lookup(pattern: NDArray[np.float32], across: Array, down: Array) -> NDArray[np.float32]:
    """(points, 3) values of a periodic pattern (size, size, 3) of period 1, linear between samples."""
    size = pattern.shape[0]
    x, y = across * size, down * size
    left, top = np.floor(x), np.floor(y)
    u, v = ((a - b).astype(np.float32)[:, None] for a, b in ((x, left), (y, top)))
    i, j = (a.astype(np.intp) % size for a in (left, top))
    right, row, below = (i + 1) % size, j * size, (j + 1) % size * size
    flat = pattern.reshape(-1, 3)
    upper = flat.take(row + i, axis=0) * (1 - u) + flat.take(row + right, axis=0) * u
    lower = flat.take(below + i, axis=0) * (1 - u) + flat.take(below + right, axis=0) * u
    out: NDArray[np.float32] = upper * (1 - v) + lower * v
    return out
