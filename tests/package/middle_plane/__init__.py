"""A method that a package of its own offers to matbench."""

import numpy as np
from attrs import field, frozen, validators

from matbench import Context, Estimate, Scene


@frozen
class MiddlePlane:
    """Everything is in the middle of the range.

    Parameters
    ----------
    share
        0 is the farthest disparity, 1 the nearest.
    """

    share: float = field(default=0.5, validator=[validators.ge(0), validators.le(1)])

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """One disparity for all pixels."""
        near, far = scene.disparities.largest, scene.disparities.least
        return Estimate({scene.ref: np.full((scene.height, scene.width), far + self.share * (near - far), np.float32)})
