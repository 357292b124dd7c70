"""Materiality without visibility: of all rays that pass through a point, those that end there."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import Matcher

# What is assumed of a point before any view or pair is asked. It weighs as half of one; a tenth of its rays end there.
# Without it, one view alone would be as certain as all that agree, and a point that none sees would be 0 / 0.
PRIOR, ENDED = 0.5, 0.05


@kernel
def agree_rows(maps, view, spans, fineness, top, material):  # type: ignore[no-untyped-def]
    """What `agreement` finds of the rows of `material` (rows, planes, W), of which `top` is the first in the maps."""
    views, _, width = maps.shape
    ended, passing = np.empty(width, np.float32), np.empty(width, np.float32)
    zero, one = np.float32(0), np.float32(1)
    for row in range(material.shape[0]):
        y = top + row
        for k in range(material.shape[1]):
            fill(np.float32(ENDED), ended)
            fill(np.float32(PRIOR), passing)
            for j in range(views):
                low, count = spans[j, k, 0], spans[j, k, 1]
                if j != view and count > 0:
                    # between two pixels the nearer one is asked, as by `weigh_seen`
                    start = spans[j, k, 5] + (1 if 2 * spans[j, k, 4] > fineness else 0)
                    for x in range(count):
                        ended[low + x] += max(one - abs(np.float32(k) - maps[j, y, start + x]), zero)
                        passing[low + x] += one
            for x in range(width):
                material[row, k, x] = ended[x] / passing[x]


def agreement(matcher: Matcher, maps: NDArray[np.float32], threads: int = 1) -> NDArray[np.float32]:
    """(H, planes, W) float32 mu on the reference view's rays, as if no point hid another.

    mu = (sum w_j + 0.05) / (sum Fr_j + 0.5) over the other views: `Fusion.seen_cost` with the frustum for V.

    Parameters
    ----------
    maps
        (views, H, W) planes of the space in which the rays end, fractions included, no NaN.
    """
    space, view = matcher.space, matcher.scene.ref
    spans = np.stack([matcher.ray_spans(view, j) for j in range(space.views)])
    material = np.empty((space.rows, space.planes, space.width), np.float32)

    def ask(top: int, end: int) -> None:
        agree_rows(maps, view, spans, space.fineness, top, material[top:end])

    over_rows(ask, space.rows, threads)
    return material
