"""Families of random worlds: each has one difficulty dialled up."""

from collections.abc import Mapping

from attrs import evolve, field, frozen


@frozen
class Dials:
    """The distributions that families change.

    Parameters
    ----------
    objects
        Least and largest number.
    kinds
        Weight of every kind of object.
    backgrounds
        Weight of every kind of background.
    far
        How many times as far the background is as what is nearest: least and largest.
    tilt
        Largest tangent of half the angle by which surfaces are tilted.
    texture
        Factor of what was measured of the texture of real surfaces: least and largest.
    materials
        Weight of every kind of material.
    disturbed
        Chance of each of gain, bias and vignetting.
    strength
        Factor of the disturbances.
    """

    objects: tuple[int, int] = (3, 10)
    kinds: Mapping[str, float] = field(
        factory=lambda: {
            "cutout": 4,
            "box": 2,
            "ball": 2,
            "tube": 1,
            "cone": 0.7,
            "plant": 1,
            "rods": 0.3,
            "lattice": 0.2,
            "ring": 0.3,
            "pile": 0.7,
        }
    )
    backgrounds: Mapping[str, float] = field(
        factory=lambda: {"wall": 1.5, "slant": 1.5, "room": 2, "corner": 1, "curved": 1}
    )
    far: tuple[float, float] = (2.2, 6.0)
    tilt: float = 0.35
    texture: tuple[float, float] = (1.0, 1.0)
    materials: Mapping[str, float] = field(
        factory=lambda: {"picture": 4, "rough": 2, "print": 1, "cloth": 0.5, "stripes": 0.4}
    )
    disturbed: float = 0.4
    strength: float = 1.0


_MIXED = Dials()

FAMILIES: Mapping[str, Dials] = {
    "mixed": _MIXED,
    "occlusion": evolve(_MIXED, objects=(10, 20), far=(4.0, 8.0), kinds={"cutout": 4, "box": 2, "ball": 2, "plant": 2}),
    "thin": evolve(_MIXED, kinds={"rods": 4, "plant": 3, "lattice": 1.5, "ring": 1.5, "cutout": 1}),
    "weak": evolve(_MIXED, texture=(0.08, 0.4)),
    "repetition": evolve(
        _MIXED, materials={"cloth": 3, "stripes": 3, "picture": 0.5}, kinds={**_MIXED.kinds, "lattice": 4}
    ),
    "slant": evolve(
        _MIXED,
        tilt=0.65,
        backgrounds={"slant": 3, "corner": 2, "curved": 2},
        kinds={"cutout": 4, "box": 2, "ball": 3, "tube": 1, "cone": 1},
    ),
    "photometric": evolve(_MIXED, disturbed=0.8, strength=2.5),
}
"""Family -> its distributions."""
