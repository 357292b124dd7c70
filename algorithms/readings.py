"""Maps of all views of a scene, read semi-globally and made to agree: what materiality and its control share."""

from collections.abc import Callable

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.fusion import Fusion, seen_from
from matbench.algorithms.mending import mend
from matbench.algorithms.semiglobal import SemiGlobal
from matbench.algorithms.similarity import Features, Matcher


@frozen(slots=False)  # a second base class must not have slots
class Readings(Fusion, SemiGlobal):
    """How the maps of all views come about.

    Parameters
    ----------
    mending
        Rounds in which what other views contradict is replaced by what trusted neighbours of its
        colour say (`mend`); 0 = none.
    """

    mending: int = field(default=3, validator=validators.ge(0))

    def first(self, matcher: Matcher, threads: int = 1) -> NDArray[np.float32]:
        """(views, H, W) maps by the better half of the pairs, as planes of the space; mended."""
        return self._read_all(matcher, lambda seen, phases: self.first_cost(seen, threads, phases), threads)

    def again(
        self, matcher: Matcher, maps: NDArray[np.float32], material: float, threads: int = 1
    ) -> NDArray[np.float32]:
        """The same by the pairs that see a point where the rays end as `maps` say.

        The cost of a point is that of `Fusion.seen_cost`, plus material (1 - mu).
        """

        def cost(seen: Matcher, phases: Features) -> NDArray[np.float32]:
            least, mu = self.seen_cost(seen, maps, threads, phases)
            np.subtract(1, mu, out=mu)
            mu *= np.float32(material)
            return np.add(least, mu, out=least)

        return self._read_all(matcher, cost, threads)

    def _read_all(
        self, matcher: Matcher, cost: Callable[[Matcher, Features], NDArray[np.float32]], threads: int
    ) -> NDArray[np.float32]:
        space, scene, phases = matcher.space, matcher.scene, matcher.phases()
        maps = np.empty((space.views, space.rows, space.width), np.float32)
        for view in range(space.views):
            maps[view] = self.read(cost(seen_from(matcher, view), phases), scene.views[view], threads)
        steps = (maps + np.float32(space.first)) / np.float32(space.fineness)
        mended = mend(steps, scene.views, 1 / scene.pair_steps, self.mending, threads)
        return np.asarray(mended * np.float32(space.fineness) - np.float32(space.first), np.float32)
