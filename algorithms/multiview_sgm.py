"""The control of SPEC 5 and 8: materiality's similarity and reader, without materiality."""

import numpy as np
from attrs import frozen

from matbench.algorithm import Context, Estimate
from matbench.algorithms.fusion import view_cost
from matbench.algorithms.semiglobal import SemiGlobal
from matbench.algorithms.similarity import Matcher, Matching
from matbench.scene import Scene


@frozen
class MultiviewSGM(Matching, SemiGlobal):
    """Semi-global matching over 1 - mean rho_ij, over the better half of the pairs with both frusta.

    The better half, rounded up, is chosen for every point: with half of the views hidden from it, the
    other half still tells. What materiality gains, it must gain over this: views, planes, pairs,
    similarity and reader are the same (parameters of `Matching` and `SemiGlobal`), only visibility
    and mu are missing.
    """

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The reference view's map; NaN only where no pair has both frusta in any plane."""
        matcher = Matcher.of(scene, self)
        view = matcher.scene.ref
        cost = view_cost(matcher, context.threads)
        found = self.read(cost, matcher.scene.views[view], context.threads)
        return Estimate(
            disparity={scene.ref: matcher.disparity(np.asarray(found))},
            work={"pair_similarities": matcher.ray_comparisons},
        )
