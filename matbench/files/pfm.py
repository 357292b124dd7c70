"""Disparities as numbers: PFM files, as Middlebury 2014 and the light field benchmark store them.

A header of three lines (``Pf``, width and height, a scale) and then rows of float32 from the bottom
of the picture to its top. A negative scale says that bytes are little-endian; its size is a unit
that nobody uses, and not used here either.

Reference: http://www.pauldebevec.com/Research/HDR/PFM/ (Debevec).
"""

import re
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from matbench.errors import UserError
from matbench.files.images import LARGEST, read_bytes

_HEADER = re.compile(rb"P([Ff])\s{1,99}(\d{1,9})\s{1,99}(\d{1,9})\s{1,99}([-+]?[0-9.eE+-]{1,40})(?:\r\n|\s)")

_MOST_HEADER = 1 << 10  # bytes; the pattern ends before
_TINIEST, _HUGEST = 1e-30, 1e6
"""Px. No disparity is closer to 0 without being it, or larger; numbers read in the wrong byte order are."""


def read_disparities(
    path: Path, size: tuple[int, int] | None = None, what: str = "ground truth"
) -> NDArray[np.float32]:
    """Read a PFM file of one number a pixel.

    Parameters
    ----------
    path
        The file.
    size
        (width, height) that it must have, if that is known.
    what
        What errors call it.

    Returns
    -------
    (H, W) float32, from top to bottom; NaN where the file has NaN or an infinity.

    Raises
    ------
    UserError
        If it is missing, of another kind, truncated, damaged, of another size or byte order.
    """
    data, name = read_bytes(path, what), f"{what} {path}"
    found = _HEADER.match(data[:_MOST_HEADER])
    if not found:
        raise UserError(f"{name} starts with {data[:8]!r}: a PFM header is 'Pf', width, height and scale")
    if found[1] == b"F":
        raise UserError(f"{name} is coloured (PF): disparities are one number a pixel (Pf)")
    width, height, scale = int(found[2]), int(found[3]), _scale(name, found[4])
    if not (width > 0 and height > 0 and width * height <= LARGEST):
        raise UserError(f"{name} claims {width}x{height} px: 1 to {LARGEST} px in all are possible")
    if size is not None and (width, height) != size:
        raise UserError(f"{name} is {width}x{height} px, not {size[0]}x{size[1]} as its view")
    wanted, present = 4 * width * height, len(data) - found.end()
    if present != wanted:
        what = "truncated" if present < wanted else "damaged"
        raise UserError(f"{name} is {what}: {present} bytes of pixels, not {wanted} ({width}x{height})")
    order = "<f4" if scale < 0 else ">f4"
    stored = np.frombuffer(data, order, width * height, found.end()).reshape(height, width)[::-1]
    values = np.where(np.isfinite(stored), stored, np.nan).astype(np.float32)
    _check_order(name, values)
    return values


def _scale(name: str, text: bytes) -> float:
    try:
        scale = float(text)
    except ValueError:
        scale = 0.0
    if not isfinite(scale) or scale == 0:
        said = text.decode("ascii")
        raise UserError(f"{name} has scale {said}: a number below 0 (little-endian) or above it is needed")
    return scale


def _check_order(name: str, values: NDArray[np.float32]) -> None:
    size = np.abs(values)
    wrong = (size > _HUGEST) | ((size > 0) & (size < _TINIEST))
    if wrong.any():
        raise UserError(
            f"{name} holds {values[wrong][0]:.3g}, which is no disparity: its bytes are in the other "
            "order than the sign of its scale says (below 0: little-endian)"
        )
