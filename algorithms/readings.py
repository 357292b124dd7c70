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

    @staticmethod
    def volume_bytes(matcher: Matcher, again: bool) -> int:
        """Bytes of the volumes that a reading holds at once: costs, sums of either sweep, and `again` materialities."""
        return (4 if again else 3) * matcher.ray_bytes

    def first(self, matcher: Matcher, threads: int = 1) -> NDArray[np.float32]:
        """(views, H, W) maps by the better half of the pairs, as planes of the space; mended."""
        return self._read_all(matcher, lambda seen, phases: self.first_cost(seen, threads, phases), threads)[0]

    def again(
        self, matcher: Matcher, maps: NDArray[np.float32], material: float, threads: int = 1
    ) -> tuple[NDArray[np.float32], float, float]:
        """The same by the pairs that see a point where the rays end as `maps` say.

        The cost of a point is that of `Fusion.seen_cost`, plus material (1 - mu).

        Returns
        -------
        The maps, and what `maps` and the new ones, before they are mended, cost by these costs: the mean over
        the views of `SemiGlobal.energy`.
        """

        def cost(seen: Matcher, phases: Features) -> NDArray[np.float32]:
            least, mu = self.seen_cost(seen, maps, threads, phases)
            np.subtract(1, mu, out=mu)
            mu *= np.float32(material)
            return np.add(least, mu, out=least)

        found, energies = self._read_all(matcher, cost, threads, maps)
        before, after = energies.mean(axis=0)
        return found, float(before), float(after)

    def _read_all(
        self,
        matcher: Matcher,
        cost: Callable[[Matcher, Features], NDArray[np.float32]],
        threads: int,
        known: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        space, scene, phases = matcher.space, matcher.scene, matcher.phases()
        maps = np.empty((space.views, space.rows, space.width), np.float32)
        energies = np.zeros((space.views, 2))
        for view, image in enumerate(scene.views):
            paid = cost(seen_from(matcher, view), phases)
            maps[view] = self.read(paid, image, threads)
            if known is not None:
                energies[view] = [self.energy(paid, image, of) for of in (known[view], maps[view])]
        steps = (maps + np.float32(space.first)) / np.float32(space.fineness)
        mended = mend(steps, scene.views, 1 / scene.pair_steps, self.mending, threads)
        planes = np.asarray(mended * np.float32(space.fineness) - np.float32(space.first), np.float32)
        return planes, energies
