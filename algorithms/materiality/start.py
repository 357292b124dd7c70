"""Where the descent starts: from the mean similarity, or softly (equation 12)."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import FULL, Matcher


@kernel
def mean_similarity(rho, pairs, first, origin, samples, mean):  # type: ignore[no-untyped-def]
    """Mean of the similarities over the pairs that hold a point in both frusta; 0 where none does.

    Parameters
    ----------
    rho
        (rows, pairs, planes, columns) uint8 in 255ths.
    mean
        (rows, planes, columns) float32 in [0, 1], overwritten.
    """
    columns = rho.shape[3]
    count = np.empty(columns, np.float32)
    scale, one = np.float32(1 / FULL), np.float32(1)
    for k in range(rho.shape[2]):
        count[:] = 0
        for p in range(pairs.shape[0]):
            start_i, start_j = pairs[p, 0] * (first + k) - origin, pairs[p, 1] * (first + k) - origin
            for x in range(max(start_i, start_j), min(start_i, start_j) + samples):
                count[x] += one
        for x in range(columns):
            count[x] = scale / max(count[x], one)
        for y in range(rho.shape[0]):
            total = mean[y, k]
            total[:] = 0
            for p in range(pairs.shape[0]):
                part = rho[y, p, k]
                for x in range(columns):
                    total[x] += np.float32(part[x])
            for x in range(columns):
                total[x] *= count[x]


@kernel
def soften(mean, views, first, origin, samples, sharpness):  # type: ignore[no-untyped-def]
    """mean <- exp(sharpness (mean - 1)), normalised along each ray and averaged over the views that see a point (12).

    Parameters
    ----------
    mean
        (rows, planes, columns) float32, overwritten.
    views, first, origin, samples
        Of the disparity space.
    """
    rows, planes, columns = mean.shape
    along = np.empty((views, samples), np.float32)
    share = np.empty((planes, columns), np.float32)
    seeing = np.zeros((planes, columns), np.float32)
    one, least = np.float32(1), np.float32(1e-30)  # nothing similar along a ray leaves it empty
    for i in range(views):
        for k in range(planes):
            start = i * (first + k) - origin
            for u in range(samples):
                seeing[k, start + u] += one
    for y in range(rows):
        for k in range(planes):
            line = mean[y, k]
            for x in range(columns):
                line[x] = np.exp(sharpness * (line[x] - one))
        along[:] = 0
        share[:] = 0
        for i in range(views):
            for k in range(planes):
                start = i * (first + k) - origin
                for u in range(samples):
                    along[i, u] += mean[y, k, start + u]
            for k in range(planes):
                start = i * (first + k) - origin
                for u in range(samples):
                    share[k, start + u] += one / max(along[i, u], least)
        for k in range(planes):
            for x in range(columns):
                mean[y, k, x] *= share[k, x] / max(seeing[k, x], one)


def start(
    matcher: Matcher, rho: NDArray[np.uint8], soft: bool, sharpness: float, threads: int = 1
) -> NDArray[np.float32]:
    """(rows, planes, columns) float32 materialities to start from.

    Parameters
    ----------
    rho
        (rows, pairs, planes, columns) similarities in 255ths.
    soft
        `soften` the mean of rho; otherwise it is taken as it is, as in the paper.
    """
    space = matcher.space
    mu = np.empty(space.shape, np.float32)

    def fill(first: int, end: int) -> None:
        mean_similarity(rho[first:end], matcher.pairs, space.first, space.origin, space.samples, mu[first:end])
        if soft:
            soften(mu[first:end], space.views, space.first, space.origin, space.samples, np.float32(sharpness))

    over_rows(fill, space.rows, threads)
    return mu
