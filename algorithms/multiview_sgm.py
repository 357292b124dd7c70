"""The control of materiality: its similarity, reader and mending, without materiality."""

from attrs import frozen

from matbench.algorithm import Context, Estimate
from matbench.algorithms.fusion import seen_from
from matbench.algorithms.readings import Readings
from matbench.algorithms.similarity import Matcher, Matching
from matbench.scene import Scene


@frozen
class MultiviewSGM(Matching, Readings):
    """Semi-global matching over 1 - mean rho_ij, over the better half of the pairs with both frusta.

    The better half, rounded up, is chosen for every point: with half of the views hidden from it, the
    other half still tells. The maps of all views are read and mended where they contradict one
    another. What materiality gains, it must gain over this: views, planes, pairs, similarity, reader
    and mending are the same (parameters of `Matching` and `Readings`), only visibility and mu are
    missing. A second reading would find nothing new, as the better half is the same again.
    """

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The reference view's map, with an answer everywhere."""
        matcher = Matcher.of(scene, self)
        maps = self.first(matcher, context.threads)
        compared = sum(seen_from(matcher, view).ray_comparisons for view in range(matcher.space.views))
        return Estimate(
            disparity={scene.ref: matcher.disparity(maps[matcher.scene.ref])},
            work={"pair_similarities": compared, "volume_bytes": self.volume_bytes(matcher, again=False)},
        )
