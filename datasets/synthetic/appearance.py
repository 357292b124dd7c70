"""How surfaces and cameras of real scenes look, in numbers: ``appearance.json``, measured by `make_appearance`."""

import json
from functools import cache
from pathlib import Path

from attrs import frozen
from cattrs import structure

APPEARANCE = Path(__file__).with_name("appearance.json")
PER_SCENE = 20
"""Patches of one scene, which follow one another."""


@frozen
class Patch:
    """A patch of a surface; all in grey levels.

    Parameters
    ----------
    brightness
        Mean over pixels and channels.
    red, blue
        By how much these channels exceed it.
    contrast
        Standard deviation of the brightness.
    fine
        That of what a Gaussian of 1 px takes away from it.
    colourfulness
        That of the channels' departures from grey.
    """

    brightness: float
    red: float
    blue: float
    contrast: float
    fine: float
    colourfulness: float

    @property
    def colour(self) -> tuple[float, float, float]:
        """Mean colour, RGB."""
        return self.brightness + self.red, self.brightness - self.red - self.blue, self.brightness + self.blue


@frozen
class Appearance:
    """What was measured.

    Parameters
    ----------
    patches
        `PER_SCENE` of each scene, one scene after the other.
    noise
        Standard deviation of the noise of each scene, grey levels.
    blur
        Spread of the sharpest edges of each scene, as the deviation of a Gaussian in px, increasing.
    """

    patches: tuple[Patch, ...]
    noise: tuple[float, ...]
    blur: tuple[float, ...]


@cache
def appearance() -> Appearance:
    """What ``appearance.json`` holds."""
    found = json.loads(APPEARANCE.read_text("utf-8"))
    patches = tuple(Patch(**dict(zip(found["patch"], row, strict=True))) for row in found["patches"])
    return Appearance(
        patches, structure(found["noise"], tuple[float, ...]), structure(found["blur"], tuple[float, ...])
    )
