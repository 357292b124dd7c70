"""Random worlds: geometry, materials, cameras and disturbances, drawn from the distributions below.

Lengths are in units of the depth of what is nearest. A slope of 1 is the width of a picture. Disparities of the field's
pair are given as shares of the width of a picture: at share s the depth is `Drawn.near` / s.

===============  ==================================================================================================
pair disparity   the nearest share 0.045 .. 0.15, the background 1.8 .. 5 times as far; logarithms uniform
background       a wall, a slanted wall, a room, a corner or a bulging or hollow wall
objects          5 to 16: cut-outs, boxes, ellipsoids, tubes and cones, plants, rods, lattices, rings, piles;
                 their disparities uniform between background and nearest, their sizes 0.05 .. 0.3 of the width
materials        five pictures (see `materials`) in each world; contrast 8 .. 45 grey levels, a fifth of the surfaces
                 hardly any
cameras          5, 7 or 9 views; the pair is that of the data sets: 2 to 4 steps, the reference view on its left
disturbances     noise 0.5 .. 3 grey levels, blur 0.3 .. 0.8 px, misalignment up to 0.25 px; in some worlds gain,
                 bias, vignetting and highlights
===============  ==================================================================================================

Numbers of `Dials` stand for the usual family; the others have one difficulty dialled up (`FAMILIES`).
"""

from collections.abc import Sequence
from math import sqrt

from attrs import evolve, frozen

from matbench.datasets.synthetic import solids
from matbench.datasets.synthetic.appearance import PER_SCENE, appearance
from matbench.datasets.synthetic.cameras import Strengths
from matbench.datasets.synthetic.dice import Dice
from matbench.datasets.synthetic.families import FAMILIES, Dials
from matbench.datasets.synthetic.materials import NUMBERS, SIZE
from matbench.datasets.synthetic.solids import Skin, Solid, flat, length, round_
from matbench.datasets.synthetic.surfaces import Vector

_PIXEL = 1 / 240  # slope of a pixel in a picture of the usual width
_PICTURES = 5  # in a world, besides the grain
_ALIKE = 0.6  # share of a world's surfaces that look like those of one real scene
_BACKDROP, _TRIES = 1.0, 30  # least contrast of what lies behind all else: no wall of a real scene is blank
_BRIGHTEST = 205.0  # grey levels of a surface's mean colour
_STRONGEST = 0.5  # largest contrast, as a share of the brightness: more would be black and white only
_GRAIN, _PATTERN, _TINT, _LIT = 4.8, 2.9, 2.6, 0.8
"""From what a patch of a picture shows to what its surface has: the cameras blur it, and it is not lit in full."""


@frozen(eq=False)
class Drawn:
    """A random world and the cameras before it.

    Parameters
    ----------
    solids
        Its surfaces.
    near
        Disparity of the pair at depth 1, as a share of the width of a picture.
    largest
        Disparity of the pair to search, as a share of the width.
    views, ref, steps
        How many views, the reference view, and the view steps of the pair.
    light
        Unit vector towards the light, and the share of light from everywhere.
    strengths
        Faults of the cameras.
    """

    solids: Sequence[Solid]
    near: float
    largest: float
    views: int
    ref: int
    steps: int
    light: tuple[float, float, float, float]
    strengths: Strengths


_LAYOUTS = {(5, 2, 2): 5.0, (5, 1, 3): 2.0, (7, 1, 4): 2.0, (9, 2, 4): 1.0}


def draw(seed: int, family: str = "mixed") -> Drawn:
    """The world of a seed: always the same."""
    dials, number = FAMILIES[family], list(FAMILIES).index(family)
    dice = Dice(number, seed)
    near, far = dice.log(0.04, 0.16), dice.log(*dials.far)
    views, ref, steps = dice.weighed(_LAYOUTS)
    world = _World(Dice(number, seed, 1), dials, far)
    world.furnish()
    looks = Dice(number, seed, 2)
    x, y = looks.between(-0.7, 0.7), looks.between(-0.75, 0.1)
    size = length((x, y, -0.7))
    return Drawn(
        solids=world.solids,
        near=near,
        largest=near * dice.between(1.12, 1.35),
        views=views,
        ref=ref,
        steps=steps,
        light=(x / size, y / size, -0.7 / size, looks.between(0.4, 0.75)),
        strengths=_strengths(Dice(number, seed, 3), dials, world.scene),
    )


def _strengths(dice: Dice, dials: Dials, scene: int) -> Strengths:
    def some(least: float, largest: float) -> float:
        drawn = dials.strength * dice.log(least, largest)
        return drawn if dice.chance(dials.disturbed) else 0.0

    return Strengths(
        noise=dials.strength * dice.log(0.8, 1.25) * appearance().noise[scene],
        blur=_like(dice, appearance().blur),
        misaligned=dice.between(0.0, 0.25),
        gain=some(0.01, 0.06),
        bias=some(0.5, 4.0),
        vignetting=some(0.05, 0.15),
        highlight=min(dials.strength * dice.log(30.0, 110.0), 200.0),
    )


def _like(dice: Dice, measured: Sequence[float]) -> float:
    """A number distributed as those that were measured, given in order: linear between them."""
    place = dice.between(0, len(measured) - 1)
    k = int(place)
    return measured[k] + (place - k) * (measured[k + 1] - measured[k])


class _World:
    """A world while it is being drawn."""

    def __init__(self, dice: Dice, dials: Dials, far: float) -> None:
        self.dice, self.dials, self.far = dice, dials, far
        self.scene = dice.whole(0, len(appearance().noise) - 1)  # the real one that most of it looks like
        self.pictures = [dice.one(NUMBERS[dice.weighed(dials.materials)]) for _ in range(_PICTURES)]
        self.solids: list[Solid] = []

    def furnish(self) -> None:
        getattr(self, f"_{self.dice.weighed(self.dials.backgrounds)}")()
        for _ in range(self.dice.whole(*self.dials.objects)):
            getattr(self, f"_{self.dice.weighed(self.dials.kinds)}")()

    # ---- looks

    def _skin(self, depth: float, least: float = 0.0) -> Skin:
        """Paint for a surface at that depth, like a patch of a real one that has at least that contrast."""
        dice = self.dice
        known = appearance().patches
        alike = known[PER_SCENE * self.scene : PER_SCENE * (self.scene + 1)]
        drawn = (dice.one(alike if dice.chance(_ALIKE) else known) for _ in range(_TRIES))
        patch = next((one for one in drawn if one.contrast >= least), known[0])
        factor = dice.log(*self.dials.texture)
        colour = [min(value / _LIT, _BRIGHTEST) for value in patch.colour]
        most = _STRONGEST * sum(colour) / 3
        fine = min(_GRAIN * patch.fine, most)
        coarse = min(_PATTERN * sqrt(max(patch.contrast**2 - patch.fine**2, 0.0)), most)
        texel = dice.log(0.5, 1.6)  # its width in px there
        return Skin(
            tile=dice.one(self.pictures),
            period=SIZE * texel * depth * _PIXEL,
            place=(dice.share(), dice.share()),
            turn=dice.turn(),
            colour=tuple(colour),  # type: ignore[arg-type]
            contrast=factor * coarse,
            gloss=dice.between(0.1, 1.0),
            grain=factor * fine,
            fineness=texel / dice.between(0.5, 0.8),
            polish=dice.weighed({2: 3.0, 3: 3.0, 5: 1.0}),
            tint=min(_TINT * patch.colourfulness / max(patch.contrast, 1.0), 4.0),
        )

    # ---- backgrounds: planes are drawn by their inverse depth, which is linear in the picture

    def _plane(self, inverse: float, across: float, down: float, depth: float) -> Solid:
        """The plane whose inverse depth is `inverse` + `across` * slope right + `down` * slope down.

        Its pattern is as fine as on what lies at `depth`.
        """
        normal = (across, down, inverse)
        size = length(normal)
        a = (inverse, 0.0, -across)
        along = tuple(value / length(a) for value in a)
        b = (
            (normal[1] * along[2] - normal[2] * along[1]) / size,
            (normal[2] * along[0] - normal[0] * along[2]) / size,
            (normal[0] * along[1] - normal[1] * along[0]) / size,
        )
        skin = self._skin(depth, _BACKDROP)
        return flat(solids.PLANE, (0.0, 0.0, 1 / inverse), along, b, skin)  # type: ignore[arg-type]

    def _wall(self, most: float = 0.25) -> None:
        inverse = 1 / self.far
        free = min(most * inverse, 0.9 - inverse)
        self.solids.append(
            self._plane(inverse, self.dice.between(-free, free), self.dice.between(-free, free), self.far)
        )

    def _slant(self) -> None:
        """A wall that leans until it nearly reaches what is nearest."""
        dice, far = self.dice, 1 / self.far
        near = dice.between(0.5, 0.95)
        middle, range_ = (far + near) / 2, (near - far) / 2
        share = dice.between(0, 1)
        # at the corners of the picture, slopes of 0.56 and 0.42, the inverse depth stays within the two
        across, down = range_ * share / 0.56, range_ * (1 - share) / 0.42
        self.solids.append(self._plane(middle, across * dice.one((-1, 1)), down * dice.one((-1, 0.5, 1)), 1 / middle))

    def _room(self) -> None:
        dice = self.dice
        self._wall(0.15)
        height = dice.between(0.4, 0.7)
        self.solids.append(self._plane(1e-4, dice.between(-0.15, 0.15), 1 / height, sqrt(self.far)))
        if dice.chance(0.4):
            self.solids.append(
                self._plane(1e-4, dice.one((-1, 1)) * dice.between(1.0, 1.7), dice.between(-0.2, 0.2), sqrt(self.far))
            )

    def _corner(self) -> None:
        """Two walls that meet; each is nearest where it leaves the picture."""
        dice, far = self.dice, 1 / self.far
        place = dice.between(-0.25, 0.25)
        for side in (-1, 1):
            near = far + (0.9 - far) * dice.between(0.2, 1.0)
            slope = side * (near - far) / (0.56 - side * place)
            self.solids.append(self._plane(far - slope * place, slope, dice.between(-0.05, 0.05), sqrt(self.far)))

    def _curved(self) -> None:
        """A wall that bulges, or is hollow, before a plain one."""
        dice, far = self.dice, self.far
        hollow = dice.chance(0.5)
        size = far * dice.log(0.9, 3.0)
        sizes = [size * dice.between(0.9, 1.6) for _ in range(3)]
        axes = self._scaled(dice.frame(0.3), *sizes)
        reach = length(tuple(axis[2] for axis in axes))  # type: ignore[arg-type]
        deep = far - reach if hollow else far * dice.between(0.5, 1.0) + reach
        centre = (dice.between(-0.3, 0.3) * far, dice.between(-0.3, 0.3) * far, deep)
        kind = solids.HOLLOW if hollow else solids.BALL
        self.solids.append(round_(kind, centre, axes, self._skin(far, _BACKDROP)))  # type: ignore[arg-type]
        self.solids.append(self._plane(0.6 / far, 0.0, 0.0, far))

    # ---- objects

    def _depth(self, reach: float = 0.0) -> float:
        """A depth whose disparity is uniform; what reaches `reach` (as a share of the depth) to the front stays behind
        the nearest.
        """
        inverse = self.dice.between(1.05 / self.far, 1.0)
        return max(1 / inverse, 1.0 / (1 - min(reach, 0.6)))

    def _place(self, depth: float) -> Vector:
        return self.dice.between(-0.56, 0.56) * depth, self.dice.between(-0.42, 0.42) * depth, depth

    def _size(self, least: float = 0.05, largest: float = 0.3) -> float:
        """Radius as a slope."""
        return self.dice.log(least, largest) / 2

    def _scaled(self, frame: Sequence[Vector], *sizes: float) -> tuple[Vector, ...]:
        return tuple(tuple(size * a for a in axis) for axis, size in zip(frame, sizes, strict=True))  # type: ignore[misc]

    def _outline(self) -> tuple[int, list[float]]:
        dice = self.dice
        kind = dice.weighed({solids.BOX: 3, solids.ELLIPSE: 1.5, solids.BLOB: 4, solids.LEAF: 0.5})
        radii = [dice.between(0.45, 1.0) for _ in range(solids.SPOKES)] if kind == solids.BLOB else []
        return kind, radii

    def _cutout(self) -> None:
        size = self._size(0.15, 0.75)
        depth = self._depth(size)
        a, b, _ = self.dice.frame(self.dials.tilt)
        along, across = self._scaled((a, b), size * depth, size * depth * self.dice.between(0.4, 1.0))
        kind, radii = self._outline()
        self.solids.append(flat(kind, self._place(depth), along, across, self._skin(depth), radii))

    def _box(self) -> None:
        size = self._size(0.12, 0.5)
        depth = self._depth(1.7 * size)
        sizes = [size * depth * self.dice.between(0.4, 1.0) for _ in range(3)]
        self._block(self._place(depth), self._scaled(self.dice.frame(0.5), *sizes), depth)

    def _block(self, middle: Vector, axes: Sequence[Vector], depth: float) -> None:
        skin = self._skin(depth)
        for k in range(3):
            normal, along, across = axes[k], axes[(k + 1) % 3], axes[(k + 2) % 3]
            # of two opposite faces only the one towards the cameras can be seen
            towards = normal[0] * middle[0] + normal[1] * middle[1] + normal[2] * middle[2]
            sign = -1.0 if towards > 0 else 1.0
            centre = tuple(m + sign * n for m, n in zip(middle, normal, strict=True))
            mine = skin if self.dice.chance(0.6) else self._skin(depth)
            mine = evolve(mine, place=(self.dice.share(), self.dice.share()))
            self.solids.append(flat(solids.BOX, centre, along, across, mine))  # type: ignore[arg-type]

    def _ball(self) -> None:
        size = self._size(0.1, 0.5)
        depth = self._depth(size)
        sizes = [size * depth * self.dice.between(0.5, 1.0) for _ in range(3)]
        axes = self._scaled(self.dice.frame(1.0), *sizes)
        self.solids.append(round_(solids.BALL, self._place(depth), axes, self._skin(depth)))  # type: ignore[arg-type]

    def _tube(self) -> None:
        self._turned(solids.TUBE, 0.0)

    def _cone(self) -> None:
        self._turned(solids.CONE, self.dice.between(-0.7, 0.7))

    def _turned(self, kind: int, taper: float) -> None:
        size = self._size(0.07, 0.28)
        depth = self._depth(2 * size)
        a, b, c = self.dice.frame(0.4)
        tall = size * self.dice.between(1.0, 3.0)
        axes = self._scaled((a, c, b), size * depth, size * depth, tall * depth)
        self.solids.append(round_(kind, self._place(depth), axes, self._skin(depth), taper))  # type: ignore[arg-type]

    def _around(self, middle: Vector, size: float, spread: Vector) -> Vector:
        """A place near another one."""
        x, y, z = (m + size * self.dice.between(-0.8, 0.8) * w for m, w in zip(middle, spread, strict=True))
        return x, y, z

    def _plant(self) -> None:
        dice = self.dice
        size = self._size(0.2, 0.5)
        depth = self._depth(size)
        middle = self._place(depth)
        skins = [self._skin(depth) for _ in range(3)]
        for _ in range(dice.whole(7, 22)):
            a, b, _ = dice.frame(self.dials.tilt + 0.2)
            tall = size * depth * dice.between(0.25, 0.6)
            wide = tall * dice.between(0.12, 0.4)
            centre = self._around(middle, size * depth, (1, 1, 0.5))
            along, across = self._scaled((a, b), tall, wide)
            mine = evolve(dice.one(skins), place=(dice.share(), dice.share()))
            self.solids.append(flat(solids.LEAF, centre, along, across, mine))

    def _rods(self) -> None:
        dice = self.dice
        depth = self._depth(0.2)
        skin = self._skin(depth)
        tilted = dice.frame(0.3)
        alike = dice.chance(0.5)
        for _ in range(dice.whole(2, 7)):
            a, b, c = tilted if alike else dice.frame(0.3)
            wide = dice.log(0.3, 2.2) * _PIXEL * depth
            axes = self._scaled((a, c, b), wide, wide, dice.between(0.1, 0.5) * depth)
            mine = evolve(skin, place=(dice.share(), dice.share()))
            middle = self._place(depth)
            self.solids.append(round_(solids.TUBE, middle, axes, mine))  # type: ignore[arg-type]

    def _lattice(self) -> None:
        dice = self.dice
        size = self._size(0.2, 0.6)
        depth = self._depth(size)
        a, b, _ = dice.frame(self.dials.tilt)
        along, across = self._scaled((a, b), size * depth, size * depth * dice.between(0.4, 1.0))
        spacing = dice.log(6, 24) * _PIXEL
        bars = [max(1.0, float(int(2 * size / spacing))) for _ in range(2)]
        widths = [dice.between(0.15, 0.5), dice.between(0.0, 0.4)]
        self.solids.append(flat(solids.LATTICE, self._place(depth), along, across, self._skin(depth), [*bars, *widths]))

    def _ring(self) -> None:
        size = self._size(0.08, 0.3)
        depth = self._depth(size)
        a, b, _ = self.dice.frame(self.dials.tilt)
        along, across = self._scaled((a, b), size * depth, size * depth * self.dice.between(0.6, 1.0))
        inner = self.dice.between(0.5, 0.92)
        self.solids.append(flat(solids.RING, self._place(depth), along, across, self._skin(depth), [inner * inner]))

    def _pile(self) -> None:
        """Stones or bricks in a heap."""
        dice = self.dice
        size = self._size(0.2, 0.5)
        depth = self._depth(size)
        middle, skin = self._place(depth), self._skin(depth)
        bricks = dice.chance(0.4)
        for _ in range(dice.whole(5, 14)):
            centre = self._around(middle, size * depth, (1, 0.6, 0.4))
            sizes = [size * depth * dice.between(0.15, 0.4) for _ in range(3)]
            axes = self._scaled(dice.frame(0.8), *sizes)
            if bricks:
                self._block(centre, axes, depth)
            else:
                mine = evolve(skin, place=(dice.share(), dice.share()))
                self.solids.append(round_(solids.BALL, centre, axes, mine))  # type: ignore[arg-type]
