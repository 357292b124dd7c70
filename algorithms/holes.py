"""Filling the holes of a disparity map: pixels without an answer."""

import numpy as np
from numpy.typing import NDArray


def fill_from_background(disparity: NDArray[np.float32]) -> NDArray[np.float32]:
    """Fill every hole of a disparity map from the farther side of its row.

    An occluded point lies behind the surface that hides it. So a hole takes the smaller of the nearest
    known disparities to its left and right (the only one, at the ends of a row). A row without any
    answer then takes the nearest row that has answers; of two equally near rows, the upper one.

    Parameters
    ----------
    disparity
        (H, W) float32, any unit, larger is nearer; NaN marks a hole. Left untouched.

    Returns
    -------
    (H, W) float32 without NaN, unless all of `disparity` is NaN.
    """
    known = ~np.isnan(disparity)
    torn = np.flatnonzero(~known.all(axis=1))
    filled = disparity.copy()
    if torn.size == 0:
        return filled
    here, columns = np.arange(disparity.shape[1]), disparity.shape[1]
    left = np.maximum.accumulate(np.where(known[torn], here, -1), axis=1)
    right = np.minimum.accumulate(np.where(known[torn], here, columns)[:, ::-1], axis=1)[:, ::-1]
    # one more column, which stands for "none" on either side: index -1 and index `columns`
    padded = np.concatenate([disparity[torn], np.full((torn.size, 1), np.inf, disparity.dtype)], axis=1)
    filled[torn] = np.minimum(np.take_along_axis(padded, left, axis=1), np.take_along_axis(padded, right, axis=1))

    answered = np.flatnonzero(known.any(axis=1))
    if answered.size == 0:
        return disparity.copy()
    empty = np.flatnonzero(~known.any(axis=1))
    nearest = np.abs(empty[:, None] - answered).argmin(axis=1)
    filled[empty] = filled[answered[nearest]]
    return filled
