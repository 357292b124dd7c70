"""The surfaces of random worlds as rows of numbers, for the compiled loops of `casting`.

World axes: X to the right, Y down, Z away from the cameras, which stand at Y = Z = 0 and look along Z.
"""

from collections.abc import Sequence
from math import sqrt

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.datasets.synthetic.surfaces import Vector, dot

BOX, ELLIPSE, LEAF, BLOB, LATTICE, RING, PLANE = range(7)
"""Outlines of a flat surface."""
BALL, HOLLOW, TUBE, CONE = range(10, 14)
"""Curved surfaces."""

SPOKES = 16  # radii of a blob's outline
_PLACE, _SHAPE = 12, 12  # a row begins with a point and a 3 x 3 matrix
WIDTH = _SHAPE + SPOKES
_NEAR = 1e-3  # depth: what comes closer may appear anywhere in the picture
_FAR = 1e6


@frozen
class Skin:
    """What is painted on a surface.

    Parameters
    ----------
    tile
        Which picture of the world's materials.
    period
        World units that the picture is wide.
    place
        Where in the picture the surface begins, in periods.
    turn
        Cosine and sine of the angle by which the picture is turned.
    colour
        Mean colour, RGB grey levels.
    contrast
        Standard deviation of the pattern, grey levels.
    gloss
        Share of the highlight that the surface returns, 0 to 1.
    grain
        Standard deviation of the grain, which is the picture 0, grey levels.
    fineness
        How many periods of the grain one of the pattern holds.
    tint
        By how much the pattern's departures from grey are multiplied.
    polish
        How often the cosine of a highlight is squared: once is a sheen over much of a surface, five times a spot.
    """

    tile: int
    period: float
    place: tuple[float, float]
    turn: tuple[float, float]
    colour: Vector
    contrast: float
    gloss: float = 0.0
    grain: float = 0.0
    fineness: float = 1.0
    tint: float = 1.0
    polish: int = 5

    def row(self) -> list[float]:
        cosine, sine = self.turn
        return [
            float(self.tile),
            cosine / self.period,
            sine / self.period,
            *self.place,
            *self.colour,
            self.contrast,
            self.gloss,
            self.grain,
            self.fineness,
            self.tint,
            float(self.polish),
        ]


@frozen
class Solid:
    """One surface.

    Parameters
    ----------
    kind
        An outline of a flat surface, or a curved surface.
    row
        `WIDTH` numbers: a point, a 3 x 3 matrix that takes what lies off the point to the surface's own axes (for
        flat ones its first row is a normal, the others are the two coordinates, -1 to 1 inside), and its shape.
    box
        Least and largest X, Y and Z; infinite for a plane.
    """

    kind: int
    row: tuple[float, ...]
    box: tuple[float, float, float, float, float, float]
    skin: Skin


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a: Vector) -> float:
    return sqrt(dot(a, a))


def _row(*parts: Sequence[float]) -> tuple[float, ...]:
    flat = [value for part in parts for value in part]
    return (*flat, *[0.0] * (WIDTH - len(flat)))


def flat(kind: int, middle: Vector, along: Vector, across: Vector, skin: Skin, shape: Sequence[float] = ()) -> Solid:
    """A flat surface: its middle, and its two half axes, which stand upright on one another.

    Parameters
    ----------
    shape
        Of a lattice: how many bars along and across, and their widths as shares of the spacing. Of a ring: the square
        of its inner radius. Of a blob: `SPOKES` radii, all around.
    """
    u, v = dot(along, along), dot(across, across)
    normal = _cross(along, across)
    size = length(normal)
    inside = (
        [a / size for a in normal],
        [a / u for a in along],
        [a / v for a in across],
    )
    reach = [abs(a) + abs(b) for a, b in zip(along, across, strict=True)]
    box = (-_FAR, _FAR, -_FAR, _FAR, 0.0, _FAR) if kind == PLANE else _box(middle, reach)
    return Solid(kind, _row(middle, *inside, shape), box, skin)


def round_(kind: int, middle: Vector, axes: tuple[Vector, Vector, Vector], skin: Skin, taper: float = 0.0) -> Solid:
    """A curved surface: its middle, and its three half axes, which stand upright on one another.

    A tube and a cone run along the third axis, and are open at their ends. `taper` is the change of a cone's radius
    from the middle to the end, as a share.
    """
    inside = [[a / dot(axis, axis) for a in axis] for axis in axes]
    if kind in (TUBE, CONE):
        wide = 1 + abs(taper)
        reach = [wide * sqrt(axes[0][k] ** 2 + axes[1][k] ** 2) + abs(axes[2][k]) for k in range(3)]
    else:
        reach = [sqrt(sum(axis[k] * axis[k] for axis in axes)) for k in range(3)]
    return Solid(kind, _row(middle, *inside, [taper]), _box(middle, reach), skin)


def _box(middle: Vector, reach: Sequence[float]) -> tuple[float, float, float, float, float, float]:
    (x, y, z), (a, b, c) = middle, reach
    return x - a, x + a, y - b, y + b, z - c, z + c


@frozen(eq=False)
class Model:
    """All surfaces of a world, nearest first.

    Parameters
    ----------
    kinds
        (S,) int64.
    rows
        (S, WIDTH) float64.
    boxes
        (S, 6) float64.
    skins
        (S, 14) float64.
    """

    kinds: NDArray[np.int64]
    rows: NDArray[np.float64]
    boxes: NDArray[np.float64]
    skins: NDArray[np.float64]

    @classmethod
    def of(cls, solids: Sequence[Solid]) -> "Model":
        sorted_ = sorted(solids, key=lambda solid: solid.box[4])  # a stable order: ties stay as they are
        return cls(
            np.array([solid.kind for solid in sorted_], np.int64),
            np.array([solid.row for solid in sorted_], np.float64),
            np.array([solid.box for solid in sorted_], np.float64),
            np.array([solid.skin.row() for solid in sorted_], np.float64),
        )

    def windows(self, eye: float) -> NDArray[np.float64]:
        """(S, 5): least and largest slope to the right, least and largest slope down, least depth, from (eye, 0, 0)."""
        left, right, top, bottom, near, far = self.boxes.T
        close = near <= _NEAR
        front = np.where(close, 1.0, near)
        sides = np.stack([(left - eye) / front, (left - eye) / far, (right - eye) / front, (right - eye) / far])
        ends = np.stack([top / front, top / far, bottom / front, bottom / far])
        found = np.stack([sides.min(0), sides.max(0), ends.min(0), ends.max(0), near], axis=1)
        found[close, :4] = (-np.inf, np.inf, -np.inf, np.inf)
        return np.ascontiguousarray(found)
