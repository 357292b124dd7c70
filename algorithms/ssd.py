"""Squared differences over shiftable windows, the plane of least cost: the simplest of the taxonomy's methods."""

from collections.abc import Mapping
from functools import partial
from typing import ClassVar

import numpy as np
from attrs import field, frozen

from matbench.algorithm import Context, Estimate
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.sampling import OnGrid
from matbench.algorithms.semiglobal import winner
from matbench.algorithms.sweep import Costs, Sweep
from matbench.parameters import flat
from matbench.scene import Scene


@flat
@frozen
class SSD(OnGrid):
    """For each pixel of the reference view the plane of least cost, over the best window that contains the pixel.

    With the defaults this is SSD+MF ("min-filter") of Scharstein & Szeliski: squared differences, the mean over
    windows of 21x21 pixels, and the least such mean among the windows that contain the pixel (`Costs`). Published
    for two views; of more, each point takes those that fit it best.

    Source: D. Scharstein, R. Szeliski, "A taxonomy and evaluation of dense two-frame stereo correspondence
    algorithms", IJCV 47, 2002.

    Parameters
    ----------
    fit
        Place answers between planes, by the equiangular fit. As published they are whole planes.
    """

    by_default: ClassVar[bool] = False

    costs: Costs = field(factory=partial(Costs, difference="squared", window=21, shiftable=True))
    fit: bool = False

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        return self.costs.silent

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view; NaN only where no other view holds a pixel in any plane."""
        sweep = Sweep.of(scene, self.costs, context.threads)
        cost = np.ascontiguousarray(sweep.cost(context.threads).transpose(0, 2, 1))
        found = winner(cost, cost)
        sure = {scene.ref: peak_ratio(cost, found, context.threads)}
        # a fraction of a half is a tie: the farther plane
        answer = found if self.fit else np.ceil(found - np.float32(0.5))
        return Estimate({scene.ref: sweep.disparity(answer)}, work=sweep.work, confidence=sure)
