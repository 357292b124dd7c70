"""The worlds before the cameras, each with one difficulty.

==========  =====================================================================================
box         a textured box on a floor before a wall: no particular difficulty
slanted     planes that all lean, about either axis; nothing faces the cameras
curved      a slanted corner, balls and a column, with disparities of either sign
spheres     balls before a bulging wall: no plane anywhere
thin        wires, rods and bars, one to a few pixels wide, upright, oblique and along the rows
fence       equal pickets, repeated along the rows, above equal rails, repeated across them
weak        hardly any texture, but for a few details
layers      flat opaque layers, one behind the other, that face the cameras
steps       posts very near before a wall very far: wide strips are hidden
highlight   glossy surfaces, whose highlights move with the camera (not Lambertian)
==========  =====================================================================================
"""

from collections.abc import Callable, Mapping, Sequence

from attrs import field, frozen

from matbench.datasets.synthetic.surfaces import Column, Disc, Paint, Rectangle, Sphere, Surface, Vector


@frozen
class World:
    """A world in front of the cameras.

    In pictures 240 px wide, the disparity at depth Z is 6 / Z - offset px per view step.

    Parameters
    ----------
    build
        Function that returns the surfaces.
    largest, offset
        The search range is from -offset to largest - offset, px per view step in pictures 240 px wide. It
        is fixed, with a margin around the true disparities.
    strengths
        Faults of the cameras, unless an option sets them.
    """

    build: Callable[[], Sequence[Surface]]
    largest: float
    offset: float = 0.0
    strengths: Mapping[str, float] = field(factory=dict)


def _wall(depth: float, paint: Paint) -> Rectangle:
    return Rectangle((-4 * depth, -4 * depth, depth), (8 * depth, 0, 0), (0, 8 * depth, 0), paint)


def _floor(y: float, paint: Paint) -> Rectangle:
    return Rectangle((-20, y, 0.2), (40, 0, 0), (0, 0, 20), paint)


def _panel(left: float, top: float, depth: float, size: tuple[float, float], paint: Paint) -> Rectangle:
    """A rectangle that faces the cameras."""
    return Rectangle((left, top, depth), (size[0], 0, 0), (0, size[1], 0), paint)


def _block(middle: Vector, cosine: float, sine: float, size: Vector, paints: Sequence[Paint]) -> list[Surface]:
    """A box turned about its upright axis: its two near sides and its top."""
    (x, y, z), (a, b, c) = middle, size
    u, w = (a * cosine, 0.0, a * sine), (-c * sine, 0.0, c * cosine)
    top = y - b / 2
    corner = (x - (u[0] + w[0]) / 2, top, z - (u[2] + w[2]) / 2)
    down = (0.0, b, 0.0)
    return [
        Rectangle(corner, u, down, paints[0]),
        Rectangle(corner, w, down, paints[1]),
        Rectangle(corner, u, w, paints[2]),
    ]


def _box() -> Sequence[Surface]:
    sides = [Paint(colour, 30, 1.0) for colour in ((206, 96, 70), (206, 96, 70), (226, 150, 84))]
    block = _block((-0.02, 0.15, 1.42), 0.8, 0.6, (0.5, 0.5, 0.42), sides)
    return [_wall(3.2, Paint((188, 180, 160), 28, 2.2)), _floor(0.4, Paint((150, 128, 106), 26, 1.1)), *block]


def _slanted() -> Sequence[Surface]:
    return [
        Rectangle((-8, -8, 10), (16, 0, -6), (0, 16, -8), Paint((140, 152, 170), 28, 2.0)),
        Rectangle((-0.72, -0.42, 1.45), (0.6, 0.06, 0.75), (0.02, 0.62, 0.1), Paint((206, 128, 84), 30, 1.0)),
        Rectangle((0.06, 0.02, 2.1), (0.62, 0.05, -0.2), (0.02, 0.36, -0.85), Paint((120, 170, 118), 30, 1.0)),
        Rectangle((0.22, -0.6, 1.9), (0.66, 0.1, -0.6), (-0.12, 0.42, 0.14), Paint((190, 176, 96), 28, 1.1)),
    ]


def _curved() -> Sequence[Surface]:
    return [
        Rectangle((0.35, -9, 3.4), (-12, 0, -7), (0, 18, 0), Paint((128, 156, 182), 26, 2.0)),
        Rectangle((0.35, -9, 3.4), (12, 0, -9), (0, 18, 0), Paint((190, 172, 150), 26, 2.0)),
        Sphere((-0.5, 0.08, 1.5), 0.3, Paint((220, 104, 88), 30, 0.9)),
        Sphere((0.08, 0.2, 1.12), 0.17, Paint((232, 198, 92), 30, 0.7)),
        Sphere((0.15, -0.42, 2.0), 0.26, Paint((128, 184, 120), 28, 1.1)),
        Column(0.52, 1.4, 0.1, Paint((164, 142, 204), 28, 0.8)),
    ]


def _spheres() -> Sequence[Surface]:
    return [
        Sphere((0.2, -0.3, 10), 7, Paint((150, 160, 176), 28, 2.2)),
        Sphere((-0.55, -0.2, 1.75), 0.36, Paint((212, 120, 92), 30, 0.9)),
        Sphere((0.0, 0.3, 1.3), 0.24, Paint((128, 178, 116), 30, 0.7)),
        Sphere((0.52, 0.02, 1.6), 0.3, Paint((140, 134, 200), 30, 0.9)),
        Sphere((0.1, -0.28, 1.12), 0.1, Paint((226, 196, 92), 30, 0.6)),
        Sphere((-0.22, 0.1, 0.92), 0.06, Paint((220, 150, 160), 30, 0.5)),
    ]


def _thin() -> Sequence[Surface]:
    wires = [
        Column(x, z, radius, Paint(colour, 24, 0.4))
        for x, z, radius, colour in (
            (-0.66, 1.6, 0.004, (60, 52, 48)),
            (-0.48, 1.3, 0.006, (196, 84, 62)),
            (-0.26, 1.5, 0.01, (70, 92, 130)),
            (-0.1, 1.1, 0.005, (64, 58, 50)),
            (0.3, 1.4, 0.008, (214, 190, 96)),
            (0.44, 1.2, 0.014, (84, 120, 84)),
        )
    ]
    oblique = [
        Rectangle((-0.2, 0.42, 1.35), (0.5, -0.6, 0.0), (0.008, 0.008, 0.0), Paint((92, 60, 110), 24, 0.4)),
        Rectangle((-0.62, -0.36, 1.7), (0.7, 0.6, 0.1), (-0.011, 0.012, 0.0), Paint((54, 62, 70), 24, 0.4)),
    ]
    level = [
        _panel(-0.5, 0.26, 1.25, (0.8, 0.008), Paint((198, 110, 60), 24, 0.4)),
        _panel(-0.1, -0.3, 1.45, (0.75, 0.016), Paint((66, 70, 96), 24, 0.4)),
    ]
    return [_wall(2.8, Paint((184, 178, 164), 28, 1.9)), *wires, *oblique, *level]


def _fence() -> Sequence[Surface]:
    """Periods of 7.5 px at depth 1.5: two view steps and more match one picket with its neighbours."""
    period, wide, depth = 0.047, 0.024, 1.5
    wood, dark = Paint((208, 186, 150), 12, 0.7, (0.1, 0.2)), Paint((120, 92, 70), 12, 0.7, (0.4, 0.7))
    pickets = [_panel(-0.56 + k * period, -0.42, depth, (wide, 0.48), wood) for k in range(23)]
    rails = [_panel(-0.42, 0.14 + k * period, depth, (1.0, wide), dark) for k in range(6)]
    return [_wall(2.6, Paint((128, 156, 120), 26, 1.8)), *pickets, *rails]


def _weak() -> Sequence[Surface]:
    faint = 1.2
    return [
        _wall(3.0, Paint((208, 206, 198), faint, 2.4)),
        _floor(0.5, Paint((156, 148, 138), faint, 1.6)),
        Rectangle((-1.28, -0.85, 2.95), (0.85, 0, 0), (0, 0.62, 0), Paint((132, 142, 124), 34, 1.4)),
        Rectangle((0.2, -0.4, 1.9), (0.9, 0, -0.55), (0, 0.9, 0), Paint((170, 192, 206), faint, 1.4)),
        Sphere((-0.16, 0.25, 1.3), 0.2, Paint((214, 172, 152), faint, 0.9)),
        Column(-0.4, 1.15, 0.025, Paint((98, 86, 78), 18, 0.5)),
    ]


def _layers() -> Sequence[Surface]:
    return [
        _wall(4.0, Paint((170, 176, 186), 28, 2.6)),
        _panel(-1.5, -0.9, 2.6, (1.1, 2.2), Paint((128, 160, 120), 28, 1.7)),
        _panel(0.35, 0.1, 2.6, (1.4, 1.0), Paint((128, 160, 120), 28, 1.7)),
        Disc((0.42, -0.3, 1.8), 0.28, Paint((208, 180, 104), 30, 1.2)),
        Disc((-0.28, 0.28, 1.8), 0.3, Paint((208, 180, 104), 30, 1.2)),
        _panel(-0.5, -0.3, 1.2, (0.34, 0.3), Paint((204, 116, 88), 30, 0.9)),
        Disc((0.26, 0.2, 1.2), 0.14, Paint((204, 116, 88), 30, 0.9)),
        Disc((-0.02, -0.06, 0.9), 0.08, Paint((150, 130, 196), 30, 0.7)),
    ]


def _steps() -> Sequence[Surface]:
    """Jumps of up to 11 px per step: behind the nearest post four view steps hide 43 px."""
    post = (204, 128, 84), (132, 140, 190), (150, 178, 110)
    return [
        _wall(4.5, Paint((176, 172, 160), 28, 2.8)),
        _panel(-0.19, -0.2, 0.5, (0.06, 0.5), Paint(post[0], 30, 0.4)),
        _panel(0.08, -0.4, 0.62, (0.07, 0.55), Paint(post[1], 30, 0.5)),
        _panel(0.24, 0.0, 0.95, (0.16, 0.6), Paint(post[2], 30, 0.7)),
    ]


def _highlight() -> Sequence[Surface]:
    return [
        Rectangle((-8, -8, 7.6), (16, 0, -4.7), (0, 16, -4.6), Paint((96, 110, 140), 20, 1.9)),
        Sphere((-0.45, 0.1, 1.6), 0.32, Paint((150, 70, 62), 20, 0.9)),
        Sphere((0.42, -0.1, 1.4), 0.22, Paint((70, 116, 80), 20, 0.8)),
        Column(0.05, 1.3, 0.07, Paint((118, 104, 60), 20, 0.6)),
        Rectangle((-0.2, 0.5, 1.15), (0.9, -0.08, 0.1), (-0.03, -0.3, 0.16), Paint((110, 84, 116), 20, 0.8)),
    ]


WORLDS: Mapping[str, World] = {
    "box": World(_box, 8),
    "curved": World(_curved, 7, offset=2.5),
    "weak": World(_weak, 7),
    "slanted": World(_slanted, 8),
    "spheres": World(_spheres, 8),
    "thin": World(_thin, 7),
    "fence": World(_fence, 6),
    "layers": World(_layers, 8),
    "steps": World(_steps, 14),
    "highlight": World(_highlight, 8, strengths={"highlight": 150}),
}
