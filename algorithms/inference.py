"""Disparity maps of all views, by semi-global matching and mending: the part that materiality and its control share."""

from collections.abc import Callable, Mapping

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.fusion import Fusion
from matbench.algorithms.mending import mend
from matbench.algorithms.outlines import outlined
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.room import Room
from matbench.algorithms.semiglobal import SemiGlobal
from matbench.algorithms.similarity import Matcher, Matching
from matbench.algorithms.support import Costs
from matbench.algorithms.surfaces import smoothed
from matbench.algorithms.windows import Features


@frozen
class Inference:
    """How disparities are inferred from similarities. A group of parameters, those of `Fusion` and `SemiGlobal` in it.

    Parameters
    ----------
    mending
        Rounds of mending: a pixel that other views contradict takes the disparity of trusted neighbours of
        its colour (`mend`). 0 = no mending.
    surfaces
        Whether unsure pixels take the disparities of the surfaces that surer pixels of their colour lie on
        (`surfaces.smoothed`), and near surfaces end where less than half of a pixel is theirs (`outlines.outlined`).
    """

    fusion: Fusion = field(factory=Fusion)
    semiglobal: SemiGlobal = field(factory=SemiGlobal)
    mending: int = field(default=3, validator=validators.ge(0))
    surfaces: bool = True

    def silent(self, matching: Matching) -> Mapping[str, str]:
        """Parameter -> what it needs to have an effect, for those without effect at this window size."""
        return {"adaptive": "window above 1"} if matching.window == 1 else {}

    def volume_bytes(self, matcher: Matcher, charged: float = 0.0) -> int:
        """Bytes of what has planes and is held at once, on one thread; with `charged` for maps that are refined."""
        shape = matcher.space.rows, matcher.space.planes, matcher.space.width
        costs = self.semiglobal.paths(self.fusion.largest(charged)).held(shape)
        return costs + self.fusion.held(matcher, charged)

    @staticmethod
    def comparisons(matcher: Matcher) -> int:
        """How many pairs of windows the maps of all views take at most: second maps leave out what no view sees."""
        return sum(matcher.with_reference(view).ray_comparisons for view in range(matcher.space.views))

    def initial_maps(
        self, matcher: Matcher, threads: int = 1, ratios: NDArray[np.float32] | None = None
    ) -> NDArray[np.float32]:
        """(views, H, W) mended maps, as plane indices; costs are from the better half of each point's similarities.

        Unsure pixels lie on the `surfaces` of surer ones.

        Parameters
        ----------
        ratios
            (H, W), overwritten if it is given, with how sure the reference view's answers are: the `peak_ratio` of
            their sums of path costs, 0 where mending has moved the answer by more than a pixel of the pair. Surfaces
            and outlines, which move answers after that, leave it as it is.
        """

        def cost(one: Matcher, phases: Features) -> Costs:
            return self.fusion.first(one, phases)

        maps, sure, _ = self._maps(matcher, cost, threads, ratios)
        return self._on_surfaces(matcher, maps, sure, threads) if self.surfaces else maps

    def refined_maps(
        self,
        matcher: Matcher,
        maps: NDArray[np.float32],
        material: float,
        threads: int = 1,
        ratios: NDArray[np.float32] | None = None,
        visibility: bool = True,
    ) -> tuple[NDArray[np.float32], float, float]:
        """The same, with costs from the pairs that see a point if the rays of all views end where `maps` say.

        The cost of a point is that of `Fusion.seen_cost`, plus material (1 - mu). Without `visibility` it is that of
        the initial maps, plus the same with mu by `agreement`. Pixels that mending has moved are not put on surfaces:
        those of the first maps have come in by mu.

        Returns
        -------
        The new maps, and the energies (`SemiGlobal.energy`, mean over the views) under these costs of `maps`
        and of the new maps before they are mended.
        """

        def cost(one: Matcher, phases: Features) -> Costs:
            return self.fusion.seen(one, phases, maps, material, visibility)

        found, sure, energies = self._maps(matcher, cost, threads, ratios, maps, material)
        if self.surfaces:
            found = self._on_surfaces(matcher, found, sure, threads, mended=False)
        before, after = energies.mean(axis=0)
        return found, float(before), float(after)

    def _maps(
        self,
        matcher: Matcher,
        cost: Callable[[Matcher, Features], Costs],
        threads: int,
        ratios: NDArray[np.float32] | None,
        known: NDArray[np.float32] | None = None,
        charged: float = 0.0,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]]:
        """Mended maps of all views, how sure they are, and the energies of the `known` maps and of the new ones.

        How sure a view is of its answers is known where it is asked: (views, H, W), or none. The reference view's are
        `ratios`, if there are any (`initial_maps`).
        """
        space, scene, phases, room = matcher.space, matcher.scene, matcher.phases(threads), Room()
        maps = np.empty((space.views, space.rows, space.width), np.float32)
        sure = np.empty_like(maps) if self.surfaces else maps[:0]
        energies = np.zeros((space.views, 2))
        # kept as whole numbers only: real ones would take twice the memory, and as much again while they are counted
        paths = self.semiglobal.paths(self.fusion.largest(charged))
        paid = room.empty("paid", paths.wide((space.rows, space.planes, space.width)), paths.kind)
        for view, image in enumerate(scene.views):
            cost(matcher.with_reference(view), phases).whole(paths.unit, paid, room, threads)
            asked = self.surfaces or (ratios is not None and view == scene.ref)
            maps[view], found = self.semiglobal.infer_whole(paid, paths, image, room, threads, asked)
            if found is not None and ratios is not None and view == scene.ref:
                ratios[:] = found
            if found is not None and self.surfaces:
                sure[view] = found
            if known is not None:
                energies[view] = [
                    self.semiglobal.energy(paid, image, of, paths.unit, threads) for of in (known[view], maps[view])
                ]
        first, q = np.float32(space.first), np.float32(space.fineness)
        steps = np.empty_like(maps)

        def in_steps(view: int, _: int) -> None:
            steps[view] = (maps[view] + first) / q

        over_rows(in_steps, space.views, threads, 1)
        mended = mend(steps, scene.views, 1 / scene.pair_steps, self.mending, threads)

        def in_planes(view: int, _: int) -> None:
            maps[view] = mended[view] * q - first
            moved = ~(np.abs(mended[view] - steps[view]) <= 1 / scene.pair_steps)
            if ratios is not None and view == scene.ref:
                ratios[moved] = 0
            sure[view : view + 1, moved] = 0

        over_rows(in_planes, space.views, threads, 1)
        return maps, sure, energies

    @staticmethod
    def _on_surfaces(
        matcher: Matcher, maps: NDArray[np.float32], sure: NDArray[np.float32], threads: int, mended: bool = True
    ) -> NDArray[np.float32]:
        """(views, H, W) the maps `smoothed` and `outlined` in pixels of the field's pair.

        Pixels that mending has moved, which are not sure at all, are smoothed only if `mended`; all are outlined.
        """
        scene, out = matcher.scene, np.empty_like(maps)
        pixels = np.float32(scene.pair_steps / matcher.space.fineness)

        def shape(view: int, _: int) -> None:
            found, image = maps[view] * pixels, scene.views[view]
            smooth = smoothed(found, sure[view], image)
            out[view] = outlined(smooth if mended else np.where(sure[view] > 0, smooth, found), image) / pixels

        over_rows(shape, len(maps), threads, 1)
        return out
