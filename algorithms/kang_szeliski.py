"""Many views, shiftable windows, the better views of each point, and a cut (Kang & Szeliski 2004)."""

from collections.abc import Mapping
from functools import partial

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.cuts.expansion import expand
from matbench.algorithms.cuts.moves import Moves
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.sampling import OnGrid
from matbench.algorithms.smoothness import Smoothness
from matbench.algorithms.sweep import Costs, Sweep, filled
from matbench.parameters import flat
from matbench.scene import Scene

OWN = {"published": 3.0, "shared": 0.2, "mccnn": 0.2}  # smoothness: grey levels, and shares of the largest cost


@flat
@frozen
class KangSzeliski(OnGrid):
    """The map f of the reference view with little energy

    E(f) = sum over p of C(p, f(p)) + sum over neighbours p, q of w min(|f(p) - f(q)|, step)

    with C the absolute difference over shiftable windows, mean over the better half of the views (`Costs`): what a
    view cannot see is hidden on one side of the reference view, and windows that shift do not reach over outlines.
    Labels expand in turn, each by a minimal cut, until none lowers E.

    With `visibility` the map says what the other views see. Then costs are taken over the views that see a point, and
    the map is found again. The published finding is that this gains little once windows shift and views are
    selected.

    Source: S. B. Kang, R. Szeliski, "Extracting view-dependent depth maps from a collection of images", IJCV 58(2),
    2004, and S. B. Kang, R. Szeliski, J. Chai, "Handling occlusions in dense multi-view stereo", CVPR 2001. Windows,
    selection and cut are theirs; that windows come before the selection, the prices, and how visibility is taken from
    the map are choices. Maps of several key views at once, their second part, are not here. A smoothness of 0 is
    3 grey levels, or 0.2 with shared costs.

    Parameters
    ----------
    step
        How many planes a change of plane counts at most; with 1 every change costs the same (Potts).
    visibility
        How often costs are taken anew over the views that see a point; shared costs are not.
    """

    costs: Costs = field(factory=partial(Costs, truncation=20.0, window=5, shiftable=True))
    prices: Smoothness = field(factory=Smoothness)
    step: int = field(default=1, validator=validators.ge(1))
    visibility: int = field(default=0, validator=validators.ge(0))
    moves: Moves = field(factory=Moves)

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        anew = {} if self.costs.similarity == "published" else {"visibility": "similarity=published"}
        return {**self.costs.silent, **self.prices.silent, **anew}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view, with an answer everywhere."""
        sweep = Sweep.of(scene, self.costs, context.threads)
        weights = self.prices.weights(sweep.scene.views[sweep.scene.ref], OWN[self.costs.similarity])
        nearest: NDArray[np.int32] | None = None
        energies: list[float] = []
        moves = self.moves
        cuts, arcs, passes = 0, 0, 1 if "visibility" in self.silent else self.visibility + 1
        for _ in range(passes):
            # rows, planes, columns
            cost = np.ascontiguousarray(np.moveaxis(filled(sweep.cost(context.threads, nearest)), 2, 1))
            found = expand(cost, weights, self.step, moves.rounds, moves.order, moves.flow, context.threads)
            energies += found.energies
            cuts, arcs = cuts + found.expansions, arcs + found.arcs
            nearest = sweep.seen_from(found.labels)
        planes = found.labels.astype(np.float32)
        return Estimate(
            {scene.ref: sweep.disparity(planes)},
            confidence={scene.ref: peak_ratio(cost, planes, context.threads)},
            history={"energy": energies},
            work={
                **{name: passes * count for name, count in sweep.compared.items()},
                "expansions": cuts,
                "arcs": arcs,
                "volume_bytes": 3 * cost.nbytes,
            },
        )
