"""How sure a method can be of its answers by their costs."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, kernel
from matbench.algorithms.parallel import over_rows


@kernel
def _peak_ratios(cost, planes, top, end, out):  # type: ignore[no-untyped-def]
    width = planes.shape[1]
    least = np.empty(width, np.float32)
    here = np.empty(width, np.float32)
    zero, one, infinite = np.float32(0), np.float32(1), np.float32(np.inf)
    for y in range(top, end):
        fill(infinite, least)
        fill(infinite, here)
        answer = planes[y]
        for k in range(cost.shape[1]):
            row, plane = cost[y, k], np.float32(k)
            for x in range(width):
                value = np.float32(row[x])
                away = abs(plane - np.rint(answer[x]))
                least[x] = value if away > one and value < least[x] else least[x]
                here[x] = value if away == zero else here[x]
        for x in range(width):
            if answer[x] != answer[x]:
                out[y, x] = np.float32(np.nan)
            elif not here[x] < least[x]:  # nor where the own cost is unknown
                out[y, x] = zero
            else:
                out[y, x] = one - max(here[x], zero) / least[x] if least[x] < infinite else zero


def peak_ratio(cost: NDArray[Any], planes: NDArray[np.float32], threads: int = 1) -> NDArray[np.float32]:
    """How far the cost of each answer lies below the least cost elsewhere: max(0, 1 - C(answer) / C(next)).

    The next is the least cost of the planes that are not beside the answer's. It is 1 less the inverse of the ratio of
    peaks (PKRN) of Hu & Mordohai, "A quantitative evaluation of confidence measures for stereo vision", PAMI 2012.

    Parameters
    ----------
    cost
        (H, planes, W or more) real numbers, at least 0; NaN = unknown.
    planes
        (H, W) plane indices; NaN = no answer.

    Returns
    -------
    (H, W) float32 in [0, 1]; NaN where there is no answer, 0 where nothing else can be compared.
    """
    out = np.empty(planes.shape, np.float32)
    over_rows(lambda top, end: _peak_ratios(cost, planes, top, end, out), len(planes), threads)
    return out
