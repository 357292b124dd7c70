"""Costs averaged over the pixels of a window that are of one colour, pixel by pixel."""

import numpy as np


def supported(cost, image, radius, adaptive):
    """sum w cost / sum w over the window within the image, w = exp(-largest colour difference / adaptive)."""
    out = np.empty(cost.shape)
    height, _, width = cost.shape
    for y, x in np.ndindex(height, width):
        rows = slice(max(0, y - radius), y + radius + 1)
        columns = slice(max(0, x - radius), x + radius + 1)
        gap = np.abs(image[rows, columns].astype(float) - image[y, x]).max(axis=2)
        weight = np.exp(-gap / adaptive)
        out[y, :, x] = (weight[:, None] * cost[rows, :, columns]).sum(axis=(0, 2)) / weight.sum()
    return out
