"""Disparity maps of all views, by semi-global matching and mending: the part that materiality and its control share."""

from collections.abc import Callable, Mapping

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.fusion import Fusion
from matbench.algorithms.mending import mend
from matbench.algorithms.semiglobal import SemiGlobal
from matbench.algorithms.similarity import Matcher, Matching
from matbench.algorithms.windows import Features


@frozen
class Inference:
    """How disparities are inferred from similarities. A group of parameters, those of `Fusion` and `SemiGlobal` in it.

    Parameters
    ----------
    mending
        Rounds of mending: a pixel that other views contradict takes the disparity of trusted neighbours of
        its colour (`mend`). 0 = no mending.
    """

    fusion: Fusion = field(factory=Fusion)
    semiglobal: SemiGlobal = field(factory=SemiGlobal)
    mending: int = field(default=3, validator=validators.ge(0))

    def silent(self, matching: Matching) -> Mapping[str, str]:
        """Parameter -> what it needs to have an effect, for those without effect at this window size."""
        return {"adaptive": "window above 1"} if matching.window == 1 else {}

    @staticmethod
    def volume_bytes(matcher: Matcher, refined: bool) -> int:
        """Bytes held at once: costs, twice as much while paths are summed and, for `refined` maps, materialities."""
        return (4 if refined else 3) * matcher.ray_bytes

    @staticmethod
    def comparisons(matcher: Matcher) -> int:
        """How many pairs of windows the maps of all views take."""
        return sum(matcher.with_reference(view).ray_comparisons for view in range(matcher.space.views))

    def initial_maps(
        self, matcher: Matcher, threads: int = 1, ratios: NDArray[np.float32] | None = None
    ) -> NDArray[np.float32]:
        """(views, H, W) mended maps, as plane indices; costs are from the better half of each point's similarities.

        Parameters
        ----------
        ratios
            (H, W), overwritten if it is given, with how sure the reference view's answers are: the `peak_ratio` of
            their sums of path costs, 0 where mending has moved the answer by more than a pixel of the pair.
        """

        def cost(one: Matcher, phases: Features) -> NDArray[np.float32]:
            return self.fusion.first_cost(one, threads, phases)

        return self._maps(matcher, cost, threads, ratios=ratios)[0]

    def refined_maps(
        self,
        matcher: Matcher,
        maps: NDArray[np.float32],
        material: float,
        threads: int = 1,
        ratios: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.float32], float, float]:
        """The same, with costs from the pairs that see a point if the rays of all views end where `maps` say.

        The cost of a point is that of `Fusion.seen_cost`, plus material (1 - mu).

        Returns
        -------
        The new maps, and the energies (`SemiGlobal.energy`, mean over the views) under these costs of `maps`
        and of the new maps before they are mended.
        """

        def cost(one: Matcher, phases: Features) -> NDArray[np.float32]:
            least, mu = self.fusion.seen_cost(one, maps, threads, phases)
            np.subtract(1, mu, out=mu)
            mu *= np.float32(material)
            return np.add(least, mu, out=least)

        found, energies = self._maps(matcher, cost, threads, maps, ratios)
        before, after = energies.mean(axis=0)
        return found, float(before), float(after)

    def _maps(
        self,
        matcher: Matcher,
        cost: Callable[[Matcher, Features], NDArray[np.float32]],
        threads: int,
        known: NDArray[np.float32] | None = None,
        ratios: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """Mended maps of all views, and for each view the energies of the `known` map and of the new one.

        The reference view's `ratios` are written, if there are any (`initial_maps`).
        """
        space, scene, phases = matcher.space, matcher.scene, matcher.phases()
        maps = np.empty((space.views, space.rows, space.width), np.float32)
        energies = np.zeros((space.views, 2))
        for view, image in enumerate(scene.views):
            paid = cost(matcher.with_reference(view), phases)
            surely = ratios is not None and view == scene.ref
            maps[view], found = self.semiglobal.infer_surely(paid, image, threads, surely)
            if ratios is not None and found is not None:
                ratios[:] = found
            if known is not None:
                energies[view] = [self.semiglobal.energy(paid, image, of) for of in (known[view], maps[view])]
        steps = (maps + np.float32(space.first)) / np.float32(space.fineness)
        mended = mend(steps, scene.views, 1 / scene.pair_steps, self.mending, threads)
        planes = np.asarray(mended * np.float32(space.fineness) - np.float32(space.first), np.float32)
        if ratios is not None:
            ratios[~(np.abs(mended[scene.ref] - steps[scene.ref]) <= 1 / scene.pair_steps)] = 0
        return planes, energies
