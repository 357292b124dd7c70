"""What is compared at a pixel besides its colour: horizontal gradient and census of the luma (SPEC 8)."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel

CENSUS_RADIUS = 3  # 7x7 pixels: 48 comparisons fit one 64-bit word
LUMA = (0.299, 0.587, 0.114)


def luma(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """(views, H, samples) brightness of (views, 3, H, samples) rows, in grey levels."""
    red, green, blue = (np.float32(weight) for weight in LUMA)
    return np.asarray(red * rows[:, 0] + green * rows[:, 1] + blue * rows[:, 2], np.float32)


def gradient(grey: NDArray[np.float32], fineness: int) -> NDArray[np.float32]:
    """Half the difference of the samples one pixel to the right and to the left; beyond an edge, its last sample."""
    q = fineness
    wide = np.concatenate([np.repeat(grey[..., :1], q, -1), grey, np.repeat(grey[..., -1:], q, -1)], axis=-1)
    return np.asarray((wide[..., 2 * q :] - wide[..., : -2 * q]) * np.float32(0.5), np.float32)


@helper
def _mark_darker(taps, centre, bits):  # type: ignore[no-untyped-def]
    one = np.uint64(1)
    for x in range(centre.size):
        bits[x] = (bits[x] << one) | np.uint64(taps[x] < centre[x])


@kernel
def _census(wide, fineness, bits):  # type: ignore[no-untyped-def]
    views, height, samples = bits.shape
    for i in range(views):
        for y in range(height):
            for dy in range(-CENSUS_RADIUS, CENSUS_RADIUS + 1):
                row = wide[i, min(max(y + dy, 0), height - 1)]
                middle = CENSUS_RADIUS * fineness
                centre = wide[i, y, middle : middle + samples]
                for dx in range(2 * CENSUS_RADIUS + 1):
                    if dy != 0 or dx != CENSUS_RADIUS:
                        _mark_darker(row[dx * fineness : dx * fineness + samples], centre, bits[i, y])


def census(grey: NDArray[np.float32], fineness: int) -> NDArray[np.uint64]:
    """(views, H, samples) census: one bit for each of the 48 pixels around, set where it is darker.

    Neighbours are whole pixels away, `fineness` samples; beyond an edge the nearest sample stands for them.
    """
    reach = CENSUS_RADIUS * fineness
    wide = np.pad(grey, ((0, 0), (0, 0), (reach, reach)), mode="edge")
    bits = np.zeros(grey.shape, np.uint64)
    _census(wide, fineness, bits)
    return bits
