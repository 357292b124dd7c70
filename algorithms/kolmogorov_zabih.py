"""Surfaces of all views at once, by graph cuts that never let a view see through one (Kolmogorov & Zabih 2002)."""

from collections.abc import Mapping
from functools import partial
from typing import ClassVar, get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.cuts.interactions import Interactions
from matbench.algorithms.cuts.lattice import Lattice, disparities, expand_views, surfaces
from matbench.algorithms.cuts.moves import Moves
from matbench.algorithms.parameters import all_or_several, planes_a_pixel, unread
from matbench.algorithms.ray_ends import agreement
from matbench.algorithms.sampling import search_space
from matbench.algorithms.similarity import PairSet
from matbench.algorithms.similarity import pairs as view_pairs
from matbench.algorithms.smoothness import Smoothness
from matbench.algorithms.sweep import SOURCES, Source
from matbench.parameters import flat
from matbench.scene import Scene

OWN = {"published": 0.0, "shared": 0.38, "mccnn": 0.38}  # reward of similar pixels; 0 = from the images
EXACT = 0.4  # of the authors' rule for it, unless ranges of colours are compared, as there: they differ less


@flat
@frozen
class KolmogorovZabih:
    """Maps f of all views at once, with the least

    E = sum over agreeing pixels p, q of min(0, D(p, q) - reward)
    + sum over the neighbours p, q of each view of w_pq min(|f_p - f_q|, step)

    that expansion moves find, among the maps in which no view sees through a surface of another. Pixels p and q
    of a pair of views agree if both have the plane in which they are homologues: then D, what their colours differ by,
    counts, and lowers E. What does not agree costs nothing, so that occluded pixels have no price but that of their
    neighbours. If a pixel has a plane, then its homologue in the other view of a pair has that or a nearer one: this is
    never violated (``violations`` in the counters of work is 0). A move offers one plane to all pixels of all
    views. The history holds E per pixel, at first, with all pixels in the farthest plane, and after each round.
    Answers are whole planes, of all views; the volume holds the planes of all maps.

    Sources: V. Kolmogorov, R. Zabih, "Multi-camera scene reconstruction via graph cuts", ECCV 2002; the values of
    the parameters are those of the authors' program for two views, as far as they are known. See
    docs/concepts/graph-cuts.md.

    Parameters
    ----------
    similarity
        ``published``: D is the mean squared difference of the colours. ``shared``: D is 1 - rho, of which the first
        costs of materiality and its control are made (`Fusion.first_cost`). ``mccnn``: the same of learned
        similarities.
    views
        Use at most this many of the scene's views, as widely spaced as they fit; 0 for all.
    fineness
        Planes per pixel of view step; 0 makes them at most one pixel of the field's pair apart.
    pairs
        The pairs of views whose pixels interact: ``consecutive`` ones, ``all``, or the ``reference`` with every
        other view.
    reward
        K, what the most similar pixels earn, in squared grey levels (the largest 511) or, if `similarity` is
        another, in shares of 1. 0 = 0.4 times the mean of one of the smallest differences of each pixel, or 0.38.
    ranges
        Compare ranges of colours, as the authors' program does, so that it matters less where pixels lie (Birchfield
        & Tomasi 1998). D is that of 30 grey levels at most then, and the reward the whole mean of that rule.
    step
        How many planes a change of plane counts at most; with 1 every change costs the same (Potts).
    """

    by_default: ClassVar[bool] = False

    similarity: Source = field(default="published", validator=SOURCES)
    views: int = field(default=5, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)
    pairs: PairSet = field(default="consecutive", validator=validators.in_(get_args(PairSet)))
    reward: float = field(default=0.0, validator=[validators.ge(0), validators.le(511)])
    ranges: bool = False
    prices: Smoothness = field(factory=partial(Smoothness, flat=3.0))
    step: int = field(default=1, validator=validators.ge(1))
    moves: Moves = field(factory=Moves)

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        takes = {"ranges": (self.similarity == "published", "similarity=published")}
        return {**self.prices.silent, **unread(takes)}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The maps of all views that are used."""
        indices = scene.widest(self.views or scene.n)
        chosen = scene.choose(indices)
        space = search_space(chosen, self.fineness)
        pairs = view_pairs(chosen.n, self.pairs, chosen.ref)
        between = Interactions.of(chosen, space, pairs, self.similarity, context.threads, by_ranges=self.ranges)
        rule = 1.0 if self.ranges else EXACT
        reward = self.reward or OWN[self.similarity] or rule * between.usual_difference(self.ranges)
        weights = [self.prices.weights(view, reward / 5) for view in chosen.views]
        down, right = (np.rint(np.stack(part) * between.units).astype(np.int32) for part in zip(*weights, strict=True))
        nothing = np.zeros((0, 0, 0, 0), np.int32)
        lattice = Lattice(
            pairs, between.shifts, between.rewards(reward), nothing, down, right, self.step, between.units
        )
        del between
        moves, probe, step = self.moves, context.probe, np.float32(indices[1] - indices[0])

        def told(number: int, energy: float, labels: NDArray[np.int32]) -> None:
            found = disparities(space, labels)
            volume = surfaces(space, found, indices)
            probe.iteration(number, {"energy": energy}, volume, disparity=found[chosen.ref] / step)

        tell = told if probe.active else None
        found = expand_views(lattice, lattice.labels, moves.rounds, moves.order, moves.flow, context.threads, tell)
        maps = disparities(space, found.labels)
        return Estimate(
            disparity={index: maps[i] / step for i, index in enumerate(indices)},
            confidence={scene.ref: agreement(maps, chosen.ref, 1 / chosen.pair_steps, context.threads)},
            volume=surfaces(space, maps, indices) if context.volume else None,
            history={"energy": found.energies},
            work={
                "expansions": found.expansions,
                "arcs": found.arcs,
                "violations": lattice.violations(found.labels),
                "volume_bytes": 2 * lattice.agreeing.nbytes,
            },
        )
