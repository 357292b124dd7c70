"""Surfaces of every kind of random worlds, somewhere in front of the cameras, and rays that meet them."""

import numpy as np

from matbench.datasets.synthetic import casting, solids
from matbench.datasets.synthetic.dice import Dice
from matbench.datasets.synthetic.solids import Skin, Solid, flat, round_

SKIN = Skin(0, 1.0, (0.0, 0.0), (1.0, 0.0), (100.0, 100.0, 100.0), 10.0)
SHAPES = {
    solids.LATTICE: [5.0, 3.0, 0.4, 0.3],
    solids.RING: [0.5],
    solids.BLOB: [0.5, 1.0, 0.8, 0.6] * 4,
}


def solid(kind: int, dice: Dice) -> Solid:
    """One in front of the cameras, turned by anything."""
    frame = dice.frame(0.6)
    sizes = [dice.between(0.2, 0.5) for _ in range(3)]
    axes = tuple(tuple(size * a for a in axis) for axis, size in zip(frame, sizes, strict=True))
    middle = (dice.between(-0.3, 0.3), dice.between(-0.2, 0.2), dice.between(1.5, 2.5))
    if kind < solids.BALL:
        return flat(kind, middle, axes[0], axes[1], SKIN, SHAPES.get(kind, ()))
    return round_(kind, middle, axes, SKIN, dice.between(-0.6, 0.6) if kind == solids.CONE else 0.0)


KINDS = [*range(solids.PLANE), solids.BALL, solids.HOLLOW, solids.TUBE, solids.CONE]


@casting.exact
def hits(kind, row, eye, rights, down, begin, count):  # type: ignore[no-untyped-def]
    work = np.empty(3 * casting.ROOM)
    casting.hits(kind, row, eye, rights, down, begin, count, work)
    return work[:count]


def hit(kind: int, row: np.ndarray, eye: float, right: float, down: float) -> float:
    """The depth at which one ray meets a surface."""
    return float(hits(kind, row, eye, np.array([right]), down, 0, 1)[0])
