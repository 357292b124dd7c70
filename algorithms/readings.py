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

        def cost(seen: Matcher, phases: Features) -> tuple[NDArray[np.float32], None]:
            return self.first_cost(seen, threads, phases), None

        return self._read_all(matcher, cost, threads)

    def again(
        self, matcher: Matcher, maps: NDArray[np.float32], material: float, threads: int = 1
    ) -> NDArray[np.float32]:
        """The same by the pairs that see a point where the rays end as `maps` say, with
        ``material (1 - mu)`` added where planes are chosen (`Fusion.seen_cost`)."""

        def cost(seen: Matcher, phases: Features) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            least, mu = self.seen_cost(seen, maps, threads, phases)
            np.subtract(1, mu, out=mu)
            mu *= np.float32(material)
            return least, mu

        return self._read_all(matcher, cost, threads)

    def _read_all(
        self,
        matcher: Matcher,
        cost: Callable[[Matcher, Features], tuple[NDArray[np.float32], NDArray[np.float32] | None]],
        threads: int,
    ) -> NDArray[np.float32]:
        space, scene, phases = matcher.space, matcher.scene, matcher.phases()
        maps = np.empty((space.views, space.rows, space.width), np.float32)
        for view in range(space.views):
            seen = seen_from(matcher, view)
            least, extra = cost(seen, phases)
            maps[view] = self.read(least, scene.views[view], threads, extra)
        steps = (maps + np.float32(space.first)) / np.float32(space.fineness)
        mended = mend(steps, scene.views, 1 / scene.pair_steps, self.mending, threads)
        return np.asarray(mended * np.float32(space.fineness) - np.float32(space.first), np.float32)
