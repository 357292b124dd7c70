"""How images become what a network takes, and its maps become those of the images."""

from collections.abc import Sequence
from math import ceil
from typing import Any, Literal, get_args

import cv2
import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.features import LUMA

Colours = Literal["rgb", "bgr", "grey"]
Fit = Literal["resize", "pad"]
CHANNELS = {"rgb": 3, "bgr": 3, "grey": 1}


def numbers(text: str) -> tuple[float, ...]:
    """The numbers in a text, separated by blanks or slashes.

    >>> numbers("0.485 0.456 0.406"), numbers("0.5/0.5/0.5"), numbers("1")
    ((0.485, 0.456, 0.406), (0.5, 0.5, 0.5), (1.0,))
    """
    return tuple(map(float, text.replace("/", " ").split()))


def _each_colour(_: object, attribute: Any, text: str) -> None:
    try:
        found = numbers(text)
    except ValueError:
        found = ()
    if len(found) not in (1, 3) or not np.isfinite(found).all() or (attribute.name == "std" and min(found) <= 0):
        above = " above 0" if attribute.name == "std" else ""
        raise ValueError(
            f"{attribute.name} is {text!r}; it must be one number{above}, or three as in 0.485/0.456/0.406"
        )


@frozen
class Picture:
    """What a network takes for a pixel. A group of parameters.

    Parameters
    ----------
    colours
        The order of the channels; ``grey`` is one channel, 0.299 R + 0.587 G + 0.114 B.
    scale
        What the largest grey level is to the network: 255, or 1.
    mean, std
        What is then subtracted from each channel, and what it is divided by: a number, or three in the order of the
        channels, as in ``0.485/0.456/0.406``.
    """

    colours: Colours = field(default="rgb", validator=validators.in_(get_args(Colours)))
    scale: float = field(default=255.0, validator=validators.gt(0))
    mean: str = field(default="0", validator=_each_colour)
    std: str = field(default="1", validator=_each_colour)

    def channels(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """(channels, H, W) float32 of an (H, W, 3) image."""
        planes = np.moveaxis(image, 2, 0).astype(np.float32)
        if self.colours == "grey":
            planes = np.tensordot(np.array(LUMA, np.float32), planes, 1)[None]
        elif self.colours == "bgr":
            planes = planes[::-1]
        planes = planes * np.float32(self.scale / 255)
        mean, std = (np.array(numbers(text), np.float32)[:, None, None] for text in (self.mean, self.std))
        return np.ascontiguousarray((planes - mean) / std, np.float32)


@frozen
class Frame:
    """How an image lies in the frame that a network takes.

    Parameters
    ----------
    size
        (height, width) of the images.
    resized
        (height, width) that they are resized to; `size` if they are not.
    frame
        (height, width) that the network is given: edges are repeated at the right and at the bottom.
    """

    size: tuple[int, int]
    resized: tuple[int, int]
    frame: tuple[int, int]

    @classmethod
    def of(cls, size: tuple[int, int], sides: Sequence[int | None], multiple: int, fit: Fit) -> "Frame":
        """The frame for images of a size.

        Parameters
        ----------
        sides
            (height, width) that the network takes; None where any does. Then it is the next multiple.
        fit
            What becomes of images along sides that are fixed.

        Raises
        ------
        ValueError
            If they are larger than a frame in which they should be padded.
        """
        height, width = (side or multiple * ceil(own / multiple) for own, side in zip(size, sides, strict=True))
        if fit == "pad" and (size[0] > height or size[1] > width):
            raise ValueError(
                f"it takes {width}x{height} px, images are {size[1]}x{size[0]}: fit=resize makes them smaller"
            )
        rows, columns = (side if side and fit == "resize" else own for own, side in zip(size, sides, strict=True))
        return cls(size, (rows, columns), (height, width))

    def put(self, planes: NDArray[np.float32]) -> NDArray[np.float32]:
        """(channels, height, width) of the frame from those of an image.

        What becomes smaller is averaged over areas, what becomes larger is interpolated linearly.
        """
        (height, width), (rows, columns) = self.size, self.resized
        if self.resized != self.size:
            how = cv2.INTER_AREA if rows <= height and columns <= width else cv2.INTER_LINEAR
            planes = np.stack([cv2.resize(plane, (columns, rows), interpolation=how) for plane in planes])
        return np.pad(planes, ((0, 0), (0, self.frame[0] - rows), (0, self.frame[1] - columns)), mode="edge")

    def take(self, disparity: NDArray[np.float32]) -> NDArray[np.float32]:
        """(H, W) map of the image from one of the frame: disparities grow with the width."""
        (height, width), (rows, columns) = self.size, self.resized
        found = np.ascontiguousarray(disparity[:rows, :columns])
        if self.resized == self.size:
            return found
        grown = np.float32(width / columns)
        return np.asarray(cv2.resize(found, (width, height), interpolation=cv2.INTER_LINEAR) * grown, np.float32)


def median_of_views(maps: Sequence[NDArray[np.float32]], weights: Sequence[float]) -> NDArray[np.float32]:
    """(H, W) for each pixel the weighted median of several maps: the least value that holds half of the weight.

    So of two maps of the same weight the farther answer is taken. NaN does not count; it stays where all are NaN.
    """
    stack = np.stack(maps)
    order = np.argsort(stack, axis=0, kind="stable")  # NaN comes last
    ranked = np.take_along_axis(stack, order, axis=0)
    weight = np.where(np.isnan(ranked), 0, np.array(weights, np.float64)[order])
    enough = np.cumsum(weight, axis=0) >= weight.sum(axis=0) / 2
    return np.asarray(np.take_along_axis(ranked, enough.argmax(axis=0)[None], axis=0)[0], np.float32)
