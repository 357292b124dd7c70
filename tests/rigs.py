"""Surfaces before cameras."""

import numpy as np
from attrs import evolve

from matbench.datasets.synthetic.rendering import Rig
from matbench.datasets.synthetic.surfaces import Paint, Rectangle
from matbench.scene import Scene

PAINT = Paint((100, 100, 100), 20, 1.0)


SMALL = {"size": "120x90"}


def wall(z: float, paint: Paint = PAINT) -> Rectangle:
    return Rectangle((-90.0, -90.0, z), (180.0, 0.0, 0.0), (0.0, 180.0, 0.0), paint)


def rig_of(*surfaces, offset: float = 0.0) -> Rig:
    return Rig(surfaces, 3, 61, 41, focal=60.0, baseline=0.1, offset=offset)


def uneven(full: Scene, kept: tuple[int, ...], step: int) -> Scene:
    """Some views of a scene at even steps, `step` of which are its view step; `full.ref` is among them."""
    return evolve(
        full,
        views=full.views[list(kept)],
        labels=tuple(full.labels[view] for view in kept),
        ref=kept.index(full.ref),
        disparities=full.disparities.scaled(step),
        truth={kept.index(view): full.truth[view] * np.float32(step) for view in kept if view in full.truth},
        visible={kept.index(view): full.visible[view][list(kept)] for view in kept if view in full.visible},
        pair_steps=full.pair_steps / step,
        positions=tuple((view - kept[0]) / step for view in kept),
    )
