"""Disparity maps as small pictures, from which the page's script reads the numbers back."""

from base64 import b64encode

import cv2
import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.recording.coloring import WORST
from matbench.scene import Scene

FINER = 8
"""Fine steps within one coarse level."""

LEAST_SIDE = 64
"""Px: no picture is made smaller, however many there are."""

_COARSE = 255  # levels of the upper half; 0 is none

# a tenth of the time of lossless WebP, and a third larger
_QUICK = (cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE)


@frozen
class Coding:
    """How the disparities of one scene are stored in the bytes of a grey picture.

    The picture is twice as high as the map. The upper half holds coarse levels of at least one pixel of the
    pair each; it also looks like a disparity map where no script colours it. The lower half holds fine steps,
    0..`FINER` - 1. Black in the upper half means no number.

    Parameters
    ----------
    low
        The least disparity that can be stored, pixels of the pair.
    unit
        The size of a coarse level, pixels of the pair.
    gain
        A byte of the upper half is this number times the coarse level, counted from 1.
    """

    low: float
    unit: float
    gain: int

    @classmethod
    def of(cls, scene: Scene) -> "Coding":
        """A coding with room for the scene's range and truth, and on both sides for errors up to the last colour."""
        ends = [scene.disparities.least, scene.disparities.largest]
        truth = scene.truth.get(scene.ref)
        if truth is not None and np.isfinite(truth).any():
            ends += [float(np.nanmin(truth)), float(np.nanmax(truth))]
        low = min(ends) * scene.pair_steps - WORST
        span = max(ends) * scene.pair_steps + WORST - low
        unit = max(1.0, span / (_COARSE - 2))
        return cls(low, unit, max(1, int(_COARSE // (np.ceil(span / unit) + 1))))

    @property
    def step(self) -> float:
        """The least difference that can be stored, pixels of the pair."""
        return self.unit / FINER

    def encode(self, disparity: NDArray[np.float32], pair_steps: float, side: int) -> str:
        """(H, W) disparities, pixels per view step -> a PNG as ``data:`` address.

        Values beyond the ends are moved to the ends. A picture longer than `side` is thinned, not blended.
        """
        values = thinned_to_side(disparity, side).astype(np.float64) * pair_steps
        known = np.isfinite(values)
        most = (_COARSE // self.gain) * FINER - 1
        level = np.zeros(values.shape, np.intp)
        level[known] = np.clip(np.rint((values[known] - self.low) / self.step), 0, most)
        coarse = np.where(known, (level // FINER + 1) * self.gain, 0)
        fine = np.where(known, level % FINER, 0)
        return _address("png", np.vstack([coarse, fine]).astype(np.uint8), _QUICK)


def side_for(pictures: int) -> int:
    """The longer side of a picture, px, if there are so many: it bounds the size of the page."""
    return int(np.clip(6100 / max(1, pictures) ** 0.5, 160, 1024))


def size_within(height: int, width: int, side: int) -> tuple[int, int]:
    """(rows, columns) of a picture whose longer side is at most `side`."""
    shrink = min(1.0, side / max(height, width))
    return max(1, round(height * shrink)), max(1, round(width * shrink))


def thinned_to_side(values: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """A map whose longer side is at most `side`: some of its pixels, not blended."""
    rows, columns = size_within(values.shape[0], values.shape[1], side)
    if (rows, columns) == values.shape:
        return values
    return np.asarray(cv2.resize(values, (columns, rows), interpolation=cv2.INTER_NEAREST), np.float32)


def photograph(picture: NDArray[np.uint8], side: int) -> str:
    """(H, W, 3) RGB -> a WebP as ``data:`` address, shrunk to `side` with blending."""
    rows, columns = size_within(picture.shape[0], picture.shape[1], side)
    smaller = picture
    if (rows, columns) != picture.shape[:2]:
        smaller = np.asarray(cv2.resize(picture, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
    return _address("webp", np.ascontiguousarray(smaller[..., ::-1]), (cv2.IMWRITE_WEBP_QUALITY, 85))


def exact(picture: NDArray[np.uint8]) -> str:
    """(H, W) grey -> a lossless WebP as ``data:`` address."""
    return _address("webp", picture, (cv2.IMWRITE_WEBP_QUALITY, 101))


def _address(kind: str, picture: NDArray[np.uint8], options: tuple[int, int]) -> str:
    done, encoded = cv2.imencode(f".{kind}", picture, options)
    if not done:
        raise RuntimeError(f"OpenCV could not encode a picture of {picture.shape[1]}x{picture.shape[0]} px")
    return f"data:image/{kind};base64," + b64encode(encoded.tobytes()).decode("ascii")
