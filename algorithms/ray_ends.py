"""How sure a method can be of its answers by where the rays of all views end."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.agreement import ENDED, PRIOR
from matbench.algorithms.fusion import sight
from matbench.algorithms.kernels import fill, kernel
from matbench.algorithms.mending import count_votes
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import Matcher


@kernel
def _rays_end_near(maps, spans, fineness, planes, answer, top, end, out):  # type: ignore[no-untyped-def]
    views, _, width = maps.shape
    through = np.empty(width, np.float32)  # of the rays of another view
    open_, ended, reached = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    zero, one = np.float32(0), np.float32(1)
    for y in range(top, end):
        fill(one, open_)
        fill(zero, out[y])
        for k in range(planes - 1, -1, -1):
            fill(np.float32(ENDED), ended)
            fill(np.float32(PRIOR), reached)
            for j in range(views):
                low, count = spans[j, k, 0], spans[j, k, 1]
                if count > 0:
                    start = spans[j, k, 5] + (1 if 2 * spans[j, k, 4] > fineness else 0)
                    sight(
                        maps[j, y, start : start + count],
                        k,
                        through[low : low + count],
                        ended[low : low + count],
                        reached[low : low + count],
                    )
            near, row = answer[y], out[y]
            for x in range(width):
                mu = min(ended[x] / reached[x], one)
                row[x] += mu * open_[x] if abs(np.float32(k) - near[x]) <= one else zero
                open_[x] *= one - mu
        for x in range(width):
            out[y, x] = min(out[y, x], one)


def rays_end_near(
    matcher: Matcher, maps: NDArray[np.float32], answer: NDArray[np.float32], threads: int = 1
) -> NDArray[np.float32]:
    """The materialities mu V at the answers: how likely each ray of the reference view ends where its answer says.

    mu is that of `consensus`, at the point of each plane on a pixel ray; a map has one value a pixel, so between two
    pixels of another view the nearer one is asked. V is the product of (1 - mu) over the nearer planes (3). The
    chance is the sum of mu V over the planes within one of the answer.

    Parameters
    ----------
    maps
        (views, H, W) float32 planes in which the rays of all views end, no NaN.
    answer
        (H, W) planes of the reference view's answers.

    Returns
    -------
    (H, W) float32 in [0, 1]; 0 where there is no answer.
    """
    space, view = matcher.space, matcher.scene.ref
    spans = np.stack([matcher.ray_spans(view, j) for j in range(space.views)])
    out = np.empty(answer.shape, np.float32)
    over_rows(
        lambda top, end: _rays_end_near(maps, spans, space.fineness, space.planes, answer, top, end, out),
        space.rows,
        threads,
    )
    return out


@kernel
def _within_one(seen, planes, top, end, out):  # type: ignore[no-untyped-def]
    for y in range(top, end):
        for x in range(planes.shape[1]):
            total = np.float32(0)
            if planes[y, x] == planes[y, x]:
                first = max(0, int(np.ceil(planes[y, x])) - 1)
                for k in range(first, min(seen.shape[2], int(np.floor(planes[y, x])) + 2)):
                    total += seen[y, x, k]
            out[y, x] = min(total, np.float32(1))


def seen_near(seen: NDArray[np.float32], planes: NDArray[np.float32], threads: int = 1) -> NDArray[np.float32]:
    """The same for materialities that are known: the sum of mu V over the planes within one of each answer.

    Parameters
    ----------
    seen
        (H, W, planes) mu V on the rays of the view, from `seen_rays`.
    planes
        (H, W) planes of its answers; NaN = no answer.

    Returns
    -------
    (H, W) float32 in [0, 1]; 0 where there is no answer.
    """
    out = np.empty(planes.shape, np.float32)
    over_rows(lambda top, end: _within_one(seen, planes, top, end, out), len(planes), threads)
    return out


def agreement(maps: NDArray[np.float32], view: int, pixel: float, threads: int = 1) -> NDArray[np.float32]:
    """The share of the other views' maps that agree with a view's, of those that agree or contradict.

    One of each is assumed before any is asked: (agreeing + 1) / (agreeing + contradicting + 2). See `count_votes`.

    Parameters
    ----------
    maps
        (views, H, W) float32 pixels per view step; NaN = no answer.
    pixel
        Pixels per view step within which maps agree.

    Returns
    -------
    (H, W) float32 in (0, 1).
    """
    agreeing, contradicting = np.empty(maps.shape[1:], np.int32), np.empty(maps.shape[1:], np.int32)
    over_rows(
        lambda top, end: count_votes(maps, view, np.float32(pixel), top, end, agreeing, contradicting),
        maps.shape[1],
        threads,
    )
    return ((agreeing + 1) / (agreeing + contradicting + 2)).astype(np.float32)
