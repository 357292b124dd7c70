"""The weighted median of a map around pixels: neighbours of like colour decide."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel
from matbench.algorithms.parallel import over_rows


@kernel
def _medians(planes, image, wanted, near, alike, out, first, end):  # type: ignore[no-untyped-def]
    height, width = planes.shape
    radius = near.shape[0] // 2
    sums = np.zeros(planes.max() + 1)
    for y in range(first, end):
        for x in range(width):
            out[y, x] = planes[y, x]
            if not wanted[y, x]:
                continue
            sums[:] = 0
            total = 0.0
            for v in range(max(0, y - radius), min(height, y + radius + 1)):
                for u in range(max(0, x - radius), min(width, x + radius + 1)):
                    apart = np.int64(0)
                    for c in range(3):
                        gap = np.int64(image[y, x, c]) - np.int64(image[v, u, c])
                        apart += gap * gap
                    weight = near[v - y + radius, u - x + radius] * alike[apart]
                    sums[planes[v, u]] += weight
                    total += weight
            plane, sofar = 0, sums[0]
            while 2 * sofar < total:
                plane += 1
                sofar += sums[plane]
            out[y, x] = plane


def weighted_median(
    planes: NDArray[np.int32],
    image: NDArray[np.uint8],
    wanted: NDArray[np.bool_],
    radius: int,
    space: float,
    colour: float,
    threads: int = 1,
) -> NDArray[np.int32]:
    """Planes whose `wanted` pixels become the weighted median of a window; the others stay.

    A neighbour weighs exp(-distance^2 / space^2 - |dI|^2 / colour^2).

    Parameters
    ----------
    planes
        (H, W) int32, 0 or more.
    image
        (H, W, 3) uint8.
    radius, space
        Of the window and of the fall of its weights, in pixels.
    colour
        Over which colours' weights fall, as a share of the range of one colour.
    """
    offsets = np.arange(-radius, radius + 1)
    near = np.exp(-(offsets[:, None] ** 2 + offsets**2) / space**2)
    alike = np.exp(-np.arange(3 * 255**2 + 1) / (255 * colour) ** 2)
    out = np.empty_like(planes)
    over_rows(lambda first, end: _medians(planes, image, wanted, near, alike, out, first, end), len(planes), threads)
    return out
