"""Disparity maps in whatever format people have them, numbers as they are stored.

PFM; PNG, PGM and TIFF of one channel; NPY, and NPZ with one array.
"""

from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.errors import UserError, cause, one_line
from matbench.files import tiff
from matbench.files.arrays import opened_arrays, read_array
from matbench.files.images import LARGEST, LARGEST_FILE, encoding, read_bytes, read_levels
from matbench.files.pfm import read_disparities

ENDINGS = (".pfm", ".png", ".npy", ".npz", ".tif", ".tiff", ".pgm")
"""What files of maps are called, in the order in which they are looked for."""


@frozen
class Reading:
    """How stored numbers are taken: disparity in pixels of the pair = sign * stored / scale."""

    scale: float = 1.0
    sign: int = 1
    unit: str = "pair"
    unknown: float | None = None

    def disparities(self, stored: NDArray[np.float32], pair_steps: float) -> NDArray[np.float32]:
        """Pixels of the field's pair, NaN where there is no answer."""
        with np.errstate(over="ignore", invalid="ignore"):  # too large for float32 is infinite: no answer
            per_pixel = np.float32(self.sign / self.scale * (pair_steps if self.unit == "step" else 1))
            values = stored * per_pixel
            if self.unknown is not None:
                values[stored == np.float32(self.unknown)] = np.nan
        values[~np.isfinite(values)] = np.nan
        return values


def read_map(path: Path) -> NDArray[np.float32]:
    """(H, W) float32: the numbers of a map as they are stored, NaN where they are not finite.

    Raises
    ------
    UserError
        If it is missing, of another kind, truncated, damaged, or no single number a pixel.
    """
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise UserError(f"map {path} ends in {ending!r}: {', '.join(ENDINGS)} can be read")
    if ending == ".pfm" or (ending in (".png", ".pgm") and encoding(path) == "pfm"):
        return read_disparities(path, what="map")
    if ending in (".png", ".pgm"):
        return read_levels(path).astype(np.float32)
    stored = _tiff(path) if ending.startswith(".tif") else _array(path)
    if stored.ndim == 3 and 1 in (stored.shape[0], stored.shape[2]):
        stored = stored.reshape([side for side in stored.shape if side != 1] or [1, 1])
    if stored.ndim != 2 or stored.dtype.kind not in "fiu" or 0 in stored.shape:
        raise UserError(f"map {path} holds {stored.shape} {stored.dtype}: rows and columns of numbers are needed")
    with np.errstate(over="ignore"):  # too large for float32 is infinite
        found = stored.astype(np.float32)
    found[~np.isfinite(found)] = np.nan
    return found


def _array(path: Path) -> NDArray[np.generic]:
    try:
        if path.suffix.lower() == ".npz":
            with opened_arrays(path) as arrays:
                if len(arrays.claims) != 1:
                    names = ", ".join(list(arrays.claims)[:5])
                    raise UserError(f"map {path} holds the arrays {names or 'none'}: one is needed")
                ((name, claim),) = arrays.claims.items()
                _check_size(path, claim.shape)
                return np.asarray(arrays.read(name))
        return read_array(path, most=LARGEST_FILE)
    except FileNotFoundError:
        raise UserError(f"map {path} is missing") from None
    except OSError as error:
        raise UserError(f"map {path} cannot be read: {cause(error)}") from error
    except (ValueError, EOFError) as error:
        raise UserError(f"map {path} cannot be read: {one_line(error)}") from error


def _tiff(path: Path) -> NDArray[np.generic]:
    data = read_bytes(path, "map")
    if (claimed := tiff.size(data)) is not None:
        _check_size(path, claimed)
        if (found := tiff.decode(data)) is not None:
            _check_size(path, found.shape)
            return found
    raise UserError(f"map {path} is no TIFF that can be read, or is damaged")


def _check_size(path: Path, shape: tuple[int, ...]) -> None:
    if not 0 < int(np.prod(shape, dtype=np.float64)) <= LARGEST:
        raise UserError(f"map {path} claims to be {shape}: 1 to {LARGEST} numbers in all are possible")
