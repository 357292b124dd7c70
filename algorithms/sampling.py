"""Image rows sampled finer than a pixel, so that matching samples in fine planes have whole-number places.

See docs/concepts/disparity-space.md.
"""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from matbench.scene import Scene
from matbench.space import DisparitySpace


def fine_rows(images: NDArray[np.uint8], fineness: int) -> NDArray[np.float32]:
    """Sample the rows of images `fineness` times finer by cubic convolution.

    Sample m lies at column m / fineness; samples on whole pixels keep their value. The kernel is
    that of Keys 1981 (a = -1/2); beyond the edge the edge pixel is repeated.

    Parameters
    ----------
    images
        (n, H, W, 3) uint8.
    fineness
        q >= 1.

    Returns
    -------
    (n, 3, H, q * (W - 1) + 1) float32, colours planar, in grey levels (cubic overshoot included).
    """
    pixels = np.ascontiguousarray(np.moveaxis(images, 3, 1), dtype=np.float32)
    width = pixels.shape[3]
    fine = np.empty((*pixels.shape[:3], fineness * (width - 1) + 1), np.float32)
    fine[..., ::fineness] = pixels
    before, after = pixels[..., :1], pixels[..., -1:]
    padded = np.concatenate([before, pixels, after], axis=3)
    for phase in range(1, fineness):
        t = phase / fineness
        weights = (
            ((2 - t) * t - 1) * t / 2,
            ((3 * t - 5) * t * t + 2) / 2,
            ((4 - 3 * t) * t + 1) * t / 2,
            (t - 1) * t * t / 2,
        )
        fine[..., phase::fineness] = sum(
            np.float32(w) * padded[..., tap : tap + width - 1] for tap, w in enumerate(weights)
        )
    return fine


def by_phase(values: NDArray[np.generic], fineness: int) -> NDArray[np.generic]:
    """Sort finely sampled rows by their phase within a pixel, so that samples a pixel apart lie side by side.

    Parameters
    ----------
    values
        (n, ..., q * (W - 1) + 1), such as from `fine_rows`.
    fineness
        q.

    Returns
    -------
    (n, q, ..., W): sample ``q * x + phase`` of a row at ``[:, phase, ..., x]``; 0 where that lies
    beyond the last pixel.
    """
    width = (values.shape[-1] - 1) // fineness + 1
    out = np.zeros((values.shape[0], fineness, *values.shape[1:-1], width), values.dtype)
    for phase in range(fineness):
        part = values[..., phase::fineness]
        out[:, phase, ..., : part.shape[-1]] = part
    return out


def search_space(scene: Scene, fineness: int = 0) -> DisparitySpace:
    """The disparity space that covers a scene's range.

    Parameters
    ----------
    fineness
        Planes per pixel of view step; 0 makes planes at most one pixel of the field's pair apart.
    """
    q = fineness or max(1, ceil(scene.pair_steps - 1e-6))
    return DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width, q)
