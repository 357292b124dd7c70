"""Scanline optimisation: every row of a map has the least cost that a row can have, whatever the other rows do."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from attrs import field, frozen, validators

from matbench.algorithm import Context, Estimate
from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.sampling import OnGrid
from matbench.algorithms.smoothness import Smoothness
from matbench.algorithms.sweep import Costs, Sweep, filled
from matbench.parameters import flat
from matbench.scene import Scene

OWN = {"published": 20.0, "shared": 0.2, "mccnn": 0.2}  # smoothness: grey levels, and shares of the largest cost


@flat
@frozen
class Scanline(OnGrid):
    """The map f whose rows each have the least

    E = sum over x of C(x, f(x)) + sum over x of w(x) min(|f(x) - f(x + 1)|, step)

    found exactly, by dynamic programming along the row (SO, scanline optimisation). Nothing ties the rows to one
    another, so their errors are streaks. Published for absolute differences of two views, pixel by pixel, and
    equal prices of all changes; of more views, each point takes those that fit it best.

    Source: D. Scharstein, R. Szeliski, "A taxonomy and evaluation of dense two-frame stereo correspondence
    algorithms", IJCV 47, 2002. A smoothness of 0 is 20 grey levels, or 0.2 with shared costs.

    Parameters
    ----------
    step
        How many planes a change of plane counts at most; with 1 every change costs the same (Potts).
    """

    by_default: ClassVar[bool] = False

    costs: Costs = field(factory=Costs)
    prices: Smoothness = field(factory=Smoothness)
    step: int = field(default=1, validator=validators.ge(1))

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        return {**self.costs.silent, **self.prices.silent}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view, with an answer everywhere."""
        sweep = Sweep.of(scene, self.costs, context.threads)
        cost = filled(sweep.cost(context.threads))
        _, along = self.prices.weights(sweep.scene.views[sweep.scene.ref], OWN[self.costs.similarity])
        found = np.empty(cost.shape[:2], np.float32)
        energies = np.empty(len(cost))

        def solve_rows(first: int, end: int) -> None:
            energies[first:end] = best_rows(cost[first:end], along[first:end], self.step, found[first:end])

        over_rows(solve_rows, len(cost), context.threads)
        return Estimate(
            {scene.ref: sweep.disparity(found)},
            history={"energy": [float(energies.sum()) / found.size]},
            work=sweep.work,
            confidence={scene.ref: peak_ratio(np.ascontiguousarray(cost.transpose(0, 2, 1)), found, context.threads)},
        )


@helper
def _cheapest(total, weight, step, reached, came):  # type: ignore[no-untyped-def]
    """reached[k] = min over l of total[l] + weight min(|k - l|, step), came[k] = that l; k if it is as good."""
    least = 0
    for k in range(total.size):
        if total[k] < total[least]:
            least = k
    for k in range(total.size):
        reached[k], came[k] = total[k], k
    for k in range(1, total.size):
        if reached[k - 1] + weight < reached[k]:
            reached[k], came[k] = reached[k - 1] + weight, came[k - 1]
    for k in range(total.size - 2, -1, -1):
        if reached[k + 1] + weight < reached[k]:
            reached[k], came[k] = reached[k + 1] + weight, came[k + 1]
    far = total[least] + step * weight
    for k in range(total.size):
        if far < reached[k]:
            reached[k], came[k] = far, least


@kernel
def best_rows(cost, weights, step, out):  # type: ignore[no-untyped-def]
    """Planes of least energy for each of some rows.

    Parameters
    ----------
    cost
        (rows, W, planes) float32, finite.
    weights
        (rows, W - 1) float32 w between a pixel and the next.
    step
        How many planes a change counts at most.
    out
        (rows, W) float32, written: the planes.

    Returns
    -------
    (rows,) float64 energies.
    """
    rows, width, planes = cost.shape
    energies = np.empty(rows)
    total, reached = np.empty(planes), np.empty(planes)
    came = np.empty((width, planes), np.int16)
    for y in range(rows):
        for k in range(planes):
            total[k] = cost[y, 0, k]
        for x in range(1, width):
            _cheapest(total, np.float64(weights[y, x - 1]), step, reached, came[x])
            for k in range(planes):
                total[k] = reached[k] + cost[y, x, k]
        plane = total.argmin()
        energies[y] = total[plane]
        for x in range(width - 1, -1, -1):
            out[y, x] = plane
            if x > 0:
                plane = np.int64(came[x, plane])
    return energies
