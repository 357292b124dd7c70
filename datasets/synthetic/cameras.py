"""Faults of cameras: blur, vignetting, gain, bias, noise and vertical misalignment.

Gain, bias and misalignment differ from camera to camera. The seed draws a share from -1 to 1 for each
camera, scaled so that the largest share has size 1 and that camera gets the full strength. Vignetting,
blur and noise are equally strong for all cameras.
"""

from collections.abc import Sequence

import numpy as np
from attrs import fields, frozen
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from matbench.datasets.synthetic.textures import noise, random_bytes

_NOISE, _GAIN, _BIAS, _HEIGHT = 2, 3, 4, 5  # part of the seed, so that each fault has random numbers of its own


@frozen
class Strengths:
    """The strength of each fault.

    Parameters
    ----------
    gain
        Largest change of a camera's gain: 0.2 multiplies by 0.8 to 1.2.
    bias
        Largest number of grey levels that a camera adds or subtracts.
    vignetting
        Share of the light that is missing in the corners of a picture.
    blur
        Standard deviation of a Gaussian blur, px.
    noise
        Standard deviation, grey levels.
    misaligned
        Largest vertical shift of a camera's picture, px.
    highlight
        Grey levels that a surface adds where it reflects the light to the camera.
    """

    gain: float = 0.0
    bias: float = 0.0
    vignetting: float = 0.0
    blur: float = 0.0
    noise: float = 1.0
    misaligned: float = 0.0
    highlight: float = 0.0


LARGEST = Strengths(gain=0.9, bias=100, vignetting=0.9, blur=20, noise=50, misaligned=20, highlight=255)

NOTHING = Strengths(noise=0.0)
"""A perfect camera."""

NAMES = tuple(each.name for each in fields(Strengths))


def shares(seed: int, kind: int, cameras: int) -> Sequence[float]:
    """One number from -1 to 1 for each camera; the largest has size 1."""
    drawn = [float(words[0]) * 256 + float(words[1]) - 32767.5 for words in _pairs(seed, kind, cameras)]
    largest = max(map(abs, drawn))
    return [value / largest for value in drawn]


def _pairs(seed: int, kind: int, cameras: int) -> NDArray[np.uint8]:
    return random_bytes((seed, kind), 2 * cameras).reshape(cameras, 2)


def heights(strengths: Strengths, seed: int, cameras: int) -> Sequence[float]:
    """How far the picture of each camera lies too low, px; empty if all are aligned."""
    return [strengths.misaligned * share for share in shares(seed, _HEIGHT, cameras)] if strengths.misaligned else ()


def exposed(
    picture: NDArray[np.float32], strengths: Strengths, seed: int, view: int, cameras: int
) -> NDArray[np.uint8]:
    """The picture as a camera with these faults records it.

    Parameters
    ----------
    picture
        (H, W, 3) RGB grey levels.
    view, cameras
        Index of the camera, and how many cameras there are.

    Returns
    -------
    (H, W, 3) uint8, rounded and clipped.
    """
    grey: NDArray[np.floating] = picture
    if strengths.blur:
        for axis in (0, 1):
            grey = gaussian_filter1d(grey.astype(np.float64), strengths.blur, axis, mode="nearest")
    if strengths.vignetting:
        grey = grey * (1 - strengths.vignetting * _from_middle(*picture.shape[:2]))[:, :, None]
    if strengths.gain:
        grey = grey * (1 + strengths.gain * shares(seed, _GAIN, cameras)[view])
    if strengths.bias:
        grey = grey + strengths.bias * shares(seed, _BIAS, cameras)[view]
    grey = grey + noise((seed, _NOISE, view), picture.shape, strengths.noise)
    grey += 0.5
    return np.clip(np.floor(grey, out=grey), 0, 255, out=grey).astype(np.uint8)


def _from_middle(height: int, width: int) -> NDArray[np.float64]:
    """(H, W) squared distance from the middle of the picture, 1 in its corners."""
    y, x = (np.arange(size) - (size - 1) / 2 for size in (height, width))
    radius: NDArray[np.float64] = (y[:, None] ** 2 + x[None, :] ** 2) / (y[0] ** 2 + x[0] ** 2)
    return radius
