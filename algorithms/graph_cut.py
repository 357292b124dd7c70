"""Expansion moves over any costs: the taxonomy's graph cut (Boykov, Veksler & Zabih 2001)."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from attrs import field, frozen, validators

from matbench.algorithm import Context, Estimate
from matbench.algorithms.cuts.expansion import expand
from matbench.algorithms.cuts.moves import Moves
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.sampling import OnGrid
from matbench.algorithms.smoothness import Smoothness
from matbench.algorithms.sweep import Costs, Sweep, filled
from matbench.parameters import flat
from matbench.scene import Scene

OWN = {"published": 10.0, "shared": 0.2, "mccnn": 0.2}  # smoothness: grey levels, and shares of the largest cost


@flat
@frozen
class GraphCut(OnGrid):
    """The map f of the reference view with the least

    E = sum over pixels of C(p, f_p) + sum over neighbours p, q of w_pq min(|f_p - f_q|, step)

    that expansion moves find: every label in turn is offered to all pixels, and those take it that together lower E
    most, which is a minimal cut of a graph. What no move lowers is within a known factor of the least E. The
    history holds E per pixel, at first and after each round. Published for absolute differences of two
    views, pixel by pixel, and equal prices of all changes; of more views, each point takes those that fit it
    best. Answers are whole planes.

    Sources: Y. Boykov, O. Veksler, R. Zabih, "Fast approximate energy minimization via graph cuts", IEEE PAMI
    23(11), 2001; D. Scharstein, R. Szeliski, "A taxonomy and evaluation of dense two-frame stereo
    correspondence algorithms", IJCV 47, 2002. A smoothness of 0 is 10 grey levels, or 0.2 with shared costs.

    Parameters
    ----------
    step
        How many planes a change of plane counts at most; with 1 every change costs the same (Potts).
    """

    by_default: ClassVar[bool] = False

    costs: Costs = field(factory=Costs)
    prices: Smoothness = field(factory=Smoothness)
    step: int = field(default=1, validator=validators.ge(1))
    moves: Moves = field(factory=Moves)

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        return {**self.costs.silent, **self.prices.silent}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view, with an answer everywhere."""
        sweep = Sweep.of(scene, self.costs, context.threads)
        cost = np.ascontiguousarray(filled(sweep.cost(context.threads)).transpose(0, 2, 1))
        weights = self.prices.weights(sweep.scene.views[sweep.scene.ref], OWN[self.costs.similarity])
        moves = self.moves
        found = expand(cost, weights, self.step, moves.rounds, moves.order, moves.flow, context.threads)
        planes = found.labels.astype(np.float32)
        return Estimate(
            {scene.ref: sweep.disparity(planes)},
            confidence={scene.ref: peak_ratio(cost, planes, context.threads)},
            history={"energy": found.energies},
            work={**sweep.work, "expansions": found.expansions, "arcs": found.arcs, "volume_bytes": 2 * cost.nbytes},
        )
