"""Dynamic programming along the rows of two views: pixels match in order, or are seen by one of the views only."""

from collections.abc import Mapping
from typing import ClassVar, get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.kernels import kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.sgbm import field_partner
from matbench.algorithms.smoothness import Smoothness
from matbench.algorithms.sweep import SOURCES, Costs, Difference, Source, Sweep, filled
from matbench.parameters import flat
from matbench.scene import Scene

OWN = {"published": 20.0, "shared": 0.2, "mccnn": 0.2}  # smoothness: grey levels, and shares of the largest cost
MATCHED, LEFT, RIGHT = range(3)  # states of a pixel and plane: seen by both views, or by one only
NEVER = np.float64(np.inf)


@flat
@frozen
class DynamicProgramming:
    """The cheapest order of matches along each row of the field's pair (DP).

    Along a row, each point (x, d) on the path is matched and pays its cost C(x, d), or is seen by the left or by
    the right view only and pays `occlusion`. The path goes on

    - from a match to a match of the next pixel and the same disparity,
    - into and through what only the left view sees by steps (x + 1, d + 1); its first step keeps d,
    - into and through what only the right view sees by steps (x, d - 1),
    - back to matches, where it pays the smoothness as well.

    The first and the last pixel are matched. So matches stay in order in both views, and a jump costs as many
    occlusions as it is high. Nothing ties the rows to one another.

    Source: D. Scharstein, R. Szeliski, "A taxonomy and evaluation of dense two-frame stereo correspondence
    algorithms", IJCV 47, 2002, after S. S. Intille, A. F. Bobick, 1994. The pair is that of `SGBM`, in planes of
    one pixel. A smoothness of 0 is 20 grey levels, or 0.2 with shared costs.

    Parameters
    ----------
    similarity, difference, truncation
        See `Costs`.
    occlusion
        What a pixel pays that one view only sees, in units of the cost; 0 = 20 grey levels, or 0.2 with shared costs.
    fill
        Do pixels that only the reference view sees take the disparity of the pixel before, from the side where
        the other view is not? Else they have none.
    """

    by_default: ClassVar[bool] = False
    uneven: ClassVar[bool] = True

    prices: Smoothness = field(factory=Smoothness)
    similarity: Source = field(default="published", validator=SOURCES)
    difference: Difference = field(default="absolute", validator=validators.in_(get_args(Difference)))
    truncation: float = field(default=0.0, validator=validators.ge(0))
    occlusion: float = field(default=0.0, validator=validators.ge(0))
    fill: bool = True

    @property
    def _costs(self) -> Costs:
        return Costs(self.similarity, 2, 1, self.difference, self.truncation)

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        costs = {name: why for name, why in self._costs.silent.items() if name in ("difference", "truncation")}
        return {**costs, **self.prices.silent}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view; NaN only with ``fill=false``."""
        pair = sorted((scene.ref, field_partner(scene)))
        chosen = scene.choose(pair)
        sweep = Sweep.of(chosen, self._costs, context.threads)
        cost = filled(sweep.cost(context.threads))
        _, along = self.prices.weights(chosen.views[chosen.ref], OWN[self.similarity])
        if chosen.ref == 1:  # the other view is to the left: as in a mirror
            cost, along = np.ascontiguousarray(cost[:, ::-1]), np.ascontiguousarray(along[:, ::-1])
        occlusion = self.occlusion or OWN[self.similarity]
        found = np.empty(cost.shape[:2], np.float32)
        energies = np.empty(len(cost))

        def solve_rows(first: int, end: int) -> None:
            part = slice(first, end)
            energies[part] = match_rows(cost[part], along[part], np.float64(occlusion), found[part])

        over_rows(solve_rows, len(cost), context.threads)
        hidden = np.isnan(found)
        sure = peak_ratio(np.ascontiguousarray(cost.transpose(0, 2, 1)), found, context.threads)
        sure[hidden] = 0  # where the answer, if there is any, is that of another pixel
        if self.fill:
            found = from_before(found)
        gap = np.float32(abs(scene.steps(field_partner(scene))))
        if chosen.ref == 1:
            found, sure = found[:, ::-1], sure[:, ::-1]
        return Estimate(
            {scene.ref: sweep.disparity(found) / gap},
            confidence={scene.ref: sure},
            history={"energy": [float(energies.sum()) / found.size]},
            work=sweep.work | {"pixels_hidden": int(hidden.sum())},
        )


def from_before(planes: NDArray[np.float32]) -> NDArray[np.float32]:
    """(H, W) planes whose NaN take the number before them in their row; a row's first pixel has one."""
    here = np.where(np.isnan(planes), 0, np.arange(planes.shape[1]))
    return np.take_along_axis(planes, np.maximum.accumulate(here, axis=1), axis=1)


@kernel
def match_rows(cost, weights, occlusion, out):  # type: ignore[no-untyped-def]
    """Planes of the cheapest path through each of some rows, see `DynamicProgramming`.

    Parameters
    ----------
    cost
        (rows, W, planes) float32, finite; planes are one pixel apart, and the other view is to the right.
    weights
        (rows, W - 1) float32: the smoothness between a pixel and the next.
    occlusion
        What a pixel pays that only one view sees.
    out
        (rows, W) float32, written: planes, NaN for a pixel that the other view does not see.

    Returns
    -------
    (rows,) float64 energies.
    """
    rows, width, planes = cost.shape
    energies = np.empty(rows)
    old, new = np.empty((3, planes)), np.empty((3, planes))
    came = np.empty((width, 3, planes), np.uint8)
    for y in range(rows):
        for k in range(planes):
            old[MATCHED, k] = cost[y, 0, k]
            old[LEFT, k] = old[RIGHT, k] = NEVER
        for x in range(1, width):
            smooth = np.float64(weights[y, x - 1])
            for k in range(planes - 1, -1, -1):
                best, state = old[MATCHED, k], MATCHED
                if k > 0 and old[LEFT, k - 1] + smooth < best:
                    best, state = old[LEFT, k - 1] + smooth, LEFT
                if old[RIGHT, k] + smooth < best:
                    best, state = old[RIGHT, k] + smooth, RIGHT
                new[MATCHED, k], came[x, MATCHED, k] = best + cost[y, x, k], state
                best, state = old[MATCHED, k], MATCHED
                if k > 0 and old[LEFT, k - 1] < best:
                    best, state = old[LEFT, k - 1], LEFT
                new[LEFT, k], came[x, LEFT, k] = best + occlusion, state
                best, state = NEVER, MATCHED
                if k < planes - 1:
                    best = new[MATCHED, k + 1]
                    if new[RIGHT, k + 1] < best:
                        best, state = new[RIGHT, k + 1], RIGHT
                new[RIGHT, k], came[x, RIGHT, k] = best + occlusion, state
            old, new = new, old
        plane, state, x = old[MATCHED].argmin(), MATCHED, width - 1
        energies[y] = old[MATCHED, plane]
        while x >= 0:
            if state != RIGHT:  # of a column's points one at most is no RIGHT
                out[y, x] = plane if state == MATCHED else np.float32(np.nan)
            before = came[x, state, plane] if x > 0 else MATCHED
            if state == RIGHT:
                plane += 1
            else:
                if before == LEFT:
                    plane -= 1
                x -= 1
            state = before
    return energies
