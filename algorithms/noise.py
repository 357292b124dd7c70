"""How noisy images are, estimated from the images themselves."""

import numpy as np
from numpy.typing import NDArray

ROUNDING = 1 / np.sqrt(12)  # standard deviation of what rounding to whole grey levels adds
MEDIAN = 0.6744897501960817  # of the absolute value of a normal variable of standard deviation 1


def noise_of(images: NDArray[np.uint8]) -> float:
    """Standard deviation of the noise of (..., H, W, 3) images, in grey levels; at least that of rounding.

    The difference of two second derivatives, across and along, ignores what is flat, slopes, or is an edge along
    rows or columns; noise of deviation 1 has deviation 6 in it. Its median absolute value ignores most texture.

    After J. Immerkaer, "Fast noise variance estimation", Computer Vision and Image Understanding 64(2), 1996, who takes
    the mean.
    """
    values = images.astype(np.float32)
    across = values[..., :-2, :, :] - 2 * values[..., 1:-1, :, :] + values[..., 2:, :, :]
    both = across[..., :-2, :] - 2 * across[..., 1:-1, :] + across[..., 2:, :]
    found = float(np.median(np.abs(both))) / (6 * MEDIAN) if both.size else 0.0
    return max(found, float(ROUNDING))
