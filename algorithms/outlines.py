"""Outlines of near surfaces, to the pixel: of a pixel that two surfaces share, the one with the larger part has it."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel

JUMP = 2.0  # pixels of disparity by which a near surface stands out
SAME = 1.5  # pixels of disparity within which neighbours are one surface
CONTRAST = 30  # grey levels, over all colours, by which two surfaces must differ to tell their parts


@kernel
def _outline(found, image, out):  # type: ignore[no-untyped-def]
    height, width = found.shape
    jump, same, least = np.float32(JUMP), np.float32(SAME), np.int64(CONTRAST) ** 2
    for y in range(height):
        for x in range(width):
            out[y, x] = found[y, x]
        for side in (-1, 1):
            for x in range(2, width - 2):
                near, far = found[y, x], found[y, x + side]
                if not near - far > jump:
                    continue
                if not (abs(near - found[y, x - side]) < same and abs(far - found[y, x + 2 * side]) < same):
                    continue
                part, whole = np.int64(0), np.int64(0)
                for c in range(image.shape[2]):
                    beyond = np.int64(image[y, x + 2 * side, c])
                    apart = np.int64(image[y, x - side, c]) - beyond
                    part += (np.int64(image[y, x, c]) - beyond) * apart
                    whole += apart * apart
                if whole > least and 2 * part < whole:
                    out[y, x] = min(out[y, x], far)


def outlined(found: NDArray[np.float32], image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(H, W) a map whose near surfaces end where less than half of a pixel is theirs.

    The last pixel of a near surface in a row shows some of what is behind, too. That mixture moves with the edge, so
    matching gives it to the near surface, however little it has of it. With F the colour of the pixel beside it on the
    near surface, and B that of the second one on the far side, its colour I says how large the near part is:
    (I - B)(F - B) / |F - B|^2. Where that is below 1/2, the pixel takes the disparity of the far side.

    It is asked where the disparity falls by more than `JUMP`, both surfaces go on by another pixel within `SAME`,
    and their colours are more than `CONTRAST` apart.

    Parameters
    ----------
    found
        (H, W) float32 disparities in pixels of the field's pair, no NaN.
    image
        (H, W, 3) uint8.
    """
    out = np.empty_like(found)
    _outline(found, image, out)
    return out
