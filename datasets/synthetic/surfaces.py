"""Simple surfaces that a ray can meet, and their paint.

World axes: X to the right, Y down, Z away from the cameras. The cameras stand at Y = Z = 0 and look
along Z.
"""

from typing import Protocol

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Point = tuple[Array, Array, Array]
Window = tuple[float, float, float, float]
"""Least and largest slope to the right, least and largest slope down."""

LIGHT: Vector = (-0.48, -0.6, -0.64)
"""Unit vector towards the light: from the upper left, behind the cameras."""

EVERYWHERE: Window = (-np.inf, np.inf, -np.inf, np.inf)

_AMBIENT = 0.45
_NEAR = 1e-3  # depth; a surface that comes closer to the cameras may appear anywhere in the picture


@frozen
class Paint:
    """A colour with a random pattern on it.

    Parameters
    ----------
    colour
        Mean colour, RGB grey levels.
    contrast
        Standard deviation of the pattern, grey levels.
    scale
        Period of the pattern, world units.
    place
        Where in the pattern the surface begins, in periods; by default at another place for every surface.
    """

    colour: Vector
    contrast: float
    scale: float
    place: tuple[float, float] | None = None


class Surface(Protocol):
    """A surface that a ray can meet."""

    @property
    def paint(self) -> Paint: ...

    def window(self, eye: float) -> Window:
        """Slopes of the rays from (eye, 0, 0) that can meet the surface. Other rays are not tried, to save time."""
        ...

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        """Depth Z at which the rays (eye, 0, 0) + Z (right, down, 1) meet the surface; infinite if they do not."""
        ...

    def coordinates(self, point: Point) -> tuple[Array, Array]:
        """Two coordinates on the surface, world units; they place the pattern on it."""
        ...

    def normal(self, point: Point) -> tuple[Array | float, Array | float, Array | float]:
        """Unit normal on the side of the cameras."""
        ...

    def shade(self, point: Point) -> Array | float:
        """Share of the light that a point returns, by Lambert's cosine law: it is the same for every camera."""
        ...


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _window_of_box(eye: float, x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Window:
    """Slopes of the rays that meet a box in the world."""
    if z[0] <= _NEAR:
        return EVERYWHERE
    across, down = ([v / depth for v in pair for depth in z] for pair in ((x[0] - eye, x[1] - eye), y))
    return min(across), max(across), min(down), max(down)


@frozen
class Rectangle:
    """A parallelogram: a corner and two edges."""

    corner: Vector
    along: Vector
    across: Vector
    paint: Paint

    @property
    def _across(self) -> Vector:
        """Some normal, of any length and on either side."""
        (a, b, c), (d, e, f) = self.along, self.across
        return b * f - c * e, c * d - a * f, a * e - b * d

    def _place(self, x: Array, y: Array, z: Array) -> tuple[Array, Array]:
        """Shares of the two edges, 0 to 1 inside."""
        p, (u, v) = self.corner, (self.along, self.across)
        uu, uv, vv = dot(u, u), dot(u, v), dot(v, v)
        det = uu * vv - uv * uv
        dual_u = tuple((vv * a - uv * b) / det for a, b in zip(u, v, strict=True))
        dual_v = tuple((uu * b - uv * a) / det for a, b in zip(u, v, strict=True))
        dx, dy, dz = x - p[0], y - p[1], z - p[2]
        return (
            dual_u[0] * dx + dual_u[1] * dy + dual_u[2] * dz,
            dual_v[0] * dx + dual_v[1] * dy + dual_v[2] * dz,
        )

    def window(self, eye: float) -> Window:
        p, u, v = self.corner, self.along, self.across
        corners = [tuple(p[k] + s * u[k] + t * v[k] for k in range(3)) for s in (0, 1) for t in (0, 1)]
        if min(z for _, _, z in corners) <= _NEAR:
            return EVERYWHERE
        across, down = [(x - eye) / z for x, _, z in corners], [y / z for _, y, z in corners]
        return min(across), max(across), min(down), max(down)

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        n, p = self._across, self.corner
        z = (n[0] * (p[0] - eye) + n[1] * p[1] + n[2] * p[2]) / (n[0] * right + n[1] * down + n[2])
        a, b = self._place(eye + z * right, z * down, z)
        return np.where((z > 0) & (a >= 0) & (a <= 1) & (b >= 0) & (b <= 1), z, np.inf)

    def coordinates(self, point: Point) -> tuple[Array, Array]:
        a, b = self._place(*point)
        return a * float(np.sqrt(dot(self.along, self.along))), b * float(np.sqrt(dot(self.across, self.across)))

    def _towards_cameras(self, point: Point) -> float:
        n = self._across
        return -1.0 if n[0] * point[0].flat[0] + n[1] * point[1].flat[0] + n[2] * point[2].flat[0] > 0 else 1.0

    def normal(self, point: Point) -> Vector:
        n = self._across
        length = self._towards_cameras(point) * float(np.sqrt(dot(n, n)))
        return n[0] / length, n[1] / length, n[2] / length

    def shade(self, point: Point) -> float:
        n = self._across
        facing = dot(n, LIGHT) / float(np.sqrt(dot(n, n)))
        return _AMBIENT + (1 - _AMBIENT) * max(0.0, self._towards_cameras(point) * facing)


@frozen
class Disc:
    """A disc that faces the cameras."""

    centre: Vector
    radius: float
    paint: Paint

    def window(self, eye: float) -> Window:
        (x, y, z), r = self.centre, self.radius
        return _window_of_box(eye, (x - r, x + r), (y - r, y + r), (z, z))

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        x, y, z = self.centre
        across, up = eye + z * right - x, z * down - y
        return np.where(across * across + up * up <= self.radius * self.radius, z, np.inf)

    def coordinates(self, point: Point) -> tuple[Array, Array]:
        return point[0] - self.centre[0], point[1] - self.centre[1]

    def normal(self, point: Point) -> Vector:  # noqa: ARG002
        return 0.0, 0.0, -1.0

    def shade(self, point: Point) -> float:  # noqa: ARG002
        return _AMBIENT + (1 - _AMBIENT) * -LIGHT[2]


@frozen
class Sphere:
    """A ball."""

    centre: Vector
    radius: float
    paint: Paint

    def window(self, eye: float) -> Window:
        (x, y, z), r = self.centre, self.radius
        return _window_of_box(eye, (x - r, x + r), (y - r, y + r), (z - r, z + r))

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        cx, cy, cz = self.centre[0] - eye, self.centre[1], self.centre[2]
        return _near_root(
            right * right + down * down + 1,
            cx * right + cy * down + cz,
            cx * cx + cy * cy + cz * cz - self.radius * self.radius,
        )

    def coordinates(self, point: Point) -> tuple[Array, Array]:
        # the pattern is projected along Z: the cameras see it without distortion
        return point[0] - self.centre[0], point[1] - self.centre[1]

    def normal(self, point: Point) -> tuple[Array, Array, Array]:
        x, y, z = ((a - c) / self.radius for a, c in zip(point, self.centre, strict=True))
        return x, y, z

    def shade(self, point: Point) -> Array:
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

    def window(self, eye: float) -> Window:
        x, z, r = self.x, self.z, self.radius
        left, right, *_ = _window_of_box(eye, (x - r, x + r), (0.0, 0.0), (z - r, z + r))
        return left, right, -np.inf, np.inf

    def depth(self, eye: float, right: Array, down: Array) -> Array:
        cx = self.x - eye
        z = _near_root(right * right + 1, cx * right + self.z, cx * cx + self.z * self.z - self.radius * self.radius)
        return np.broadcast_to(z, np.broadcast_shapes(right.shape, down.shape))

    def coordinates(self, point: Point) -> tuple[Array, Array]:
        return point[0] - self.x, point[1]

    def normal(self, point: Point) -> tuple[Array, float, Array]:
        return (point[0] - self.x) / self.radius, 0.0, (point[2] - self.z) / self.radius

    def shade(self, point: Point) -> Array:
        facing = ((point[0] - self.x) * LIGHT[0] + (point[2] - self.z) * LIGHT[2]) / self.radius
        return _AMBIENT + (1 - _AMBIENT) * np.maximum(0.0, facing)


def _near_root(a: Array, b: Array, c: float) -> Array:
    """The smaller positive root of a z² - 2 b z + c; infinite where there is none."""
    inside = b * b - a * c
    z = (b - np.sqrt(np.maximum(inside, 0.0))) / a
    return np.where((inside > 0) & (z > 0), z, np.inf)
