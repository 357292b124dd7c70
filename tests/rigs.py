"""Surfaces before cameras."""

from matbench.datasets.synthetic.rendering import Rig
from matbench.datasets.synthetic.surfaces import Paint, Rectangle

PAINT = Paint((100, 100, 100), 20, 1.0)


SMALL = {"size": "120x90"}


def wall(z: float, paint: Paint = PAINT) -> Rectangle:
    return Rectangle((-90.0, -90.0, z), (180.0, 0.0, 0.0), (0.0, 180.0, 0.0), paint)


def rig_of(*surfaces, offset: float = 0.0) -> Rig:
    return Rig(surfaces, 3, 61, 41, focal=60.0, baseline=0.1, offset=offset)
