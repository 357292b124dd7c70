"""The control of materiality: the same similarities, inference and mending, but no materiality."""

from collections.abc import Mapping

import numpy as np
from attrs import field, frozen

from matbench.algorithm import Context, Estimate
from matbench.algorithms.inference import Inference
from matbench.algorithms.similarity import Matcher, Matching
from matbench.parameters import flat
from matbench.scene import Scene


@flat
@frozen
class MultiviewSGM:
    """Semi-global matching over 1 - mean rho_ij, over the better half of the pairs with both frusta.

    The better half, rounded up, is chosen for every point: even if half of the views cannot see it, the
    other half can. The maps of all views are inferred, and mended where they contradict one another. This
    method shows what materiality gains. Views, planes, pairs, similarities, inference and mending are the
    same (parameters of `Matching` and `Inference`); only visibility and mu are missing. A second pass
    would change nothing, because the better half would be the same.
    """

    matching: Matching = field(factory=Matching)
    inference: Inference = field(factory=Inference)

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        return {**self.matching.silent, **self.inference.silent(self.matching)}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The reference view's map, with an answer everywhere."""
        matcher = Matcher.of(scene, self.matching, context.threads).on_rays(context.threads)
        sure = np.empty((scene.height, scene.width), np.float32)
        maps = self.inference.initial_maps(matcher, context.threads, sure)
        return Estimate(
            disparity={scene.ref: matcher.disparity(maps[matcher.scene.ref])},
            confidence={scene.ref: sure},
            work={
                "pair_similarities": self.inference.comparisons(matcher),
                "volume_bytes": self.inference.volume_bytes(matcher),
            },
        )
