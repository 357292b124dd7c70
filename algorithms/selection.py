"""Which of the other views count for a point: what several of them cost becomes one cost."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel, literal

Selection = Literal["mean", "half", "side"]
MEAN, HALF, SIDE = range(3)


def select(costs: NDArray[np.float32], selection: Selection, ref: int) -> NDArray[np.float32]:
    """(H, W) costs from those of each view, (views, H, W) with NaN where a view does not hold the point.

    Parameters
    ----------
    selection
        See `Costs`.
    ref
        How many of the views are to the left of the reference view.
    """
    out = np.empty(costs.shape[1:], np.float32)
    select_views(costs, {"mean": MEAN, "half": HALF, "side": SIDE}[selection], ref, out)
    return out


@literal
def _select_row(costs, rule, ref, known, out):  # type: ignore[no-untyped-def]
    views, width = costs.shape
    for x in range(width):
        count, left = 0, 0
        for view in range(views):
            cost = costs[view, x]
            if np.isfinite(cost):
                place = count
                if rule == HALF:  # sorted as they come
                    while place > 0 and known[place - 1] > cost:
                        known[place] = known[place - 1]
                        place -= 1
                known[place] = cost
                count += 1
                left += view < ref
        if rule == HALF:
            count = (count + 1) // 2
        total, other = np.float32(0), np.float32(0)
        for place in range(count):
            if rule == SIDE and place >= left:
                other += known[place]
            else:
                total += known[place]
        if rule != SIDE or count == left or left == 0:
            out[x] = (total + other) / np.float32(count) if count > 0 else np.float32(np.nan)
        else:
            out[x] = min(total / np.float32(left), other / np.float32(count - left))


@kernel
def select_views(costs, rule, ref, out):  # type: ignore[no-untyped-def]
    """out <- the mean of the known costs of a point, of the better half of them, or of the better side of `ref`."""
    known = np.empty(costs.shape[0], np.float32)
    for y in range(out.shape[0]):
        _select_row(costs[:, y], rule, ref, known, out[y])
