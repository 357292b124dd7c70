"""Rays of volumes."""

import numpy as np

from matbench.measures.volumes import Rays, StoredVolume, rays_of
from matbench.scene import Scene

SMALL = {"size": "96x72"}


def along(stored: StoredVolume, scene: Scene) -> Rays:
    """The rays of all known pixels."""
    (rays,) = rays_of(stored, scene, [np.ones((scene.height, scene.width), bool)])
    return rays
