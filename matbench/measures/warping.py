"""Warping between two views by disparities: a disparity map to another view, and another view's colours back."""

import numpy as np
from numpy.typing import NDArray

TEAR = 1.0
"""Px in the other view. Two neighbours belong to one surface if their shifts differ by no more than this. Otherwise
the surface is torn, and what lies behind it may show through."""

_ROUNDING = 1e-4  # px: float32 rounding does not decide a tie


def carry(disparity: NDArray[np.float32], steps: float) -> NDArray[np.float64]:
    """Warp a disparity map to another view, with a z-buffer.

    A pixel at column x goes to ``x - steps * disparity``. Two neighbours in a row that belong to one
    surface (`TEAR`) cover every column between them, with disparities interpolated linearly, so that a
    surface that widens leaves no holes. At a tear, or beside an unknown pixel, a pixel covers only the
    nearest column. Where several surfaces cover a column, the nearest one counts.

    Parameters
    ----------
    disparity
        (H, W), pixels per view step, NaN where unknown.
    steps
        View steps to the other view; negative if it is to the left.

    Returns
    -------
    (H, W) float64 disparity at the pixels of the other view, NaN where nothing is carried to.
    """
    height, width = disparity.shape
    values = disparity.astype(np.float64)
    known = np.isfinite(values)
    place = np.arange(width) - steps * np.where(known, values, 0.0)
    whole = known[:, 1:] & known[:, :-1]
    whole &= np.abs(steps) * np.abs(np.diff(np.where(known, values, 0.0), axis=1)) <= TEAR + _ROUNDING
    nearest = np.full((height, width), -np.inf)

    def put(rows: NDArray[np.intp], columns: NDArray[np.float64], found: NDArray[np.float64]) -> None:
        inside = (columns >= 0) & (columns < width)
        # several surfaces may come to one column: `at` takes all of them into account, an assignment only one
        np.maximum.at(nearest, (rows[inside], columns[inside].astype(np.intp)), found[inside])

    torn = known.copy()
    torn[:, 1:] &= ~whole
    end = known.copy()
    end[:, :-1] &= ~whole
    rows, columns = np.nonzero(torn | end)
    put(rows, np.floor(place[rows, columns] + 0.5), values[rows, columns])
    rows, columns = np.nonzero(whole)
    start, span = place[rows, columns], place[rows, columns + 1] - place[rows, columns]
    low, rise = values[rows, columns], values[rows, columns + 1] - values[rows, columns]
    first = np.ceil(start - _ROUNDING)
    for more in range(int(1 + TEAR) + 1):
        column = first + more
        on = (column <= start + span + _ROUNDING) & (span > _ROUNDING)
        share = (column[on] - start[on]) / span[on]
        put(rows[on], column[on], low[on] + share * rise[on])
    nearest[np.isinf(nearest)] = np.nan
    return nearest


def picture_columns(image: NDArray[np.uint8]) -> tuple[int, int]:
    """The first and the last column that are not all black: rectified views may have black borders.

    For an image that is all black, the first and the last column of all.
    """
    lit = np.flatnonzero(image.any(axis=(0, 2)))
    return (int(lit[0]), int(lit[-1])) if len(lit) else (0, image.shape[1] - 1)


def warped(image: NDArray[np.uint8], disparity: NDArray[np.float32], steps: float) -> NDArray[np.float32]:
    """The reference view, reconstructed from the colours of the view that is `steps` view steps to its right.

    Parameters
    ----------
    image
        (H, W, 3) of that view.
    disparity
        (H, W) of the reference view, pixels per view step.

    Returns
    -------
    (H, W, 3) float32, cubic between pixels; NaN where the disparity is NaN or leads out of the
    frame, or into its black border (`picture_columns`).
    """
    import cv2

    height, width = disparity.shape
    columns = np.arange(width, dtype=np.float32) - np.float32(steps) * disparity
    rows = np.broadcast_to(np.arange(height, dtype=np.float32)[:, None], (height, width))
    first, last = picture_columns(image)
    inside = (columns >= first) & (columns <= last)  # False for NaN
    columns = np.where(inside, columns, np.float32(0))
    border = cv2.BORDER_REPLICATE
    found = cv2.remap(image.astype(np.float32), columns, rows, cv2.INTER_CUBIC, borderMode=border)
    found[~inside] = np.nan
    return np.asarray(found, np.float32)
