"""How strongly adjacent target points are tied: less where the images have an edge between them (equation 8)."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import FULL
from matbench.space import DisparitySpace


@kernel
def _mean_weights(per_view, first, origin, top, end, weights):  # type: ignore[no-untyped-def]
    """weights (rows, planes, columns) in 255ths = the mean over the views that see a point of their weights.

    `per_view` (views, rows, samples) are weights in [0, 1].
    """
    views, _, samples = per_view.shape
    _, planes, columns = weights.shape
    total, count = np.empty(columns, np.float32), np.empty(columns, np.float32)
    one, full, half = np.float32(1), np.float32(FULL), np.float32(0.5)
    for y in range(top, end):
        for k in range(planes):
            total[:] = 0
            count[:] = 0
            for i in range(views):
                start = i * (first + k) - origin
                for u in range(samples):
                    total[start + u] += per_view[i, y, u]
                    count[start + u] += one
            out = weights[y, k]
            for x in range(columns):
                out[x] = np.uint8(full * total[x] / max(count[x], one) + half)


def edge_weights(
    rows: NDArray[np.float32], space: DisparitySpace, edge: float, threads: int = 1
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Weights w = exp(-|dI| / edge) between neighbouring points, averaged over the views.

    Parameters
    ----------
    rows
        (views, 3, H, samples) float32 colours; |dI| is the mean over them.
    edge
        Grey levels of difference from one pixel to the next over which a weight falls to 1/e.

    Returns
    -------
    down
        (rows, planes, columns) uint8 in 255ths: between y and y + 1; 0 in the last row.
    right
        (rows, planes, columns + 1): between x - 1 and x; 0 at both ends.
    """
    per_view = np.zeros((2, *rows[:, 0].shape), np.float32)
    per_view[0, :, :-1] = np.exp(np.abs(np.diff(rows, axis=2)).mean(axis=1) / -edge)
    per_view[1, ..., :-1] = np.exp(np.abs(np.diff(rows, axis=3)).mean(axis=1) * space.fineness / -edge)
    down = np.empty(space.shape, np.uint8)
    right = np.zeros((space.rows, space.planes, space.columns + 1), np.uint8)

    def fill(top: int, end: int) -> None:
        _mean_weights(per_view[0], space.first, space.origin, top, end, down)
        _mean_weights(per_view[1], space.first, space.origin, top, end, right[..., 1:])

    over_rows(fill, space.rows, threads)
    return down, right
