"""Descriptors of the patches around pixels, by a network that was trained to compare patches: MC-CNN, fast.

Source: J. Zbontar, Y. LeCun, "Stereo matching by training a convolutional neural network to compare image patches",
JMLR 17(65), 2016. The weights are those in the package `mccnn` of CNES (Apache-2.0), the ones with depth-wise
convolutions. Only that file of the package is read; nothing of it is imported or run.

From an image normalised to mean 0 and deviation 1, five layers make 64 numbers of every pixel. A layer convolves each
channel with 3x3 weights of its own, and then mixes the channels; after all but the last, what is below 0 becomes 0. So
a descriptor depends on 11x11 pixels. It is divided by its length. The scalar product of two descriptors says how like
they are.
"""

from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from matbench.algorithms.kernels import kernel
from matbench.algorithms.parallel import over_rows
from matbench.errors import UserError
from matbench.files.onnx_file import read_model

CHANNELS = 64
RADIUS = 5  # pixels around that decide
STEPS = 127  # that a number of a descriptor between 0 and 1 is rounded to
INSTALL = "pip install 'matbench-stereo[mccnn]'"
_FILE = "weights/mc_cnn_fast_dw.onnx"
_DIGESTS = {"2803ce5d6d3d947a482ed671bbfd18186fc079075190e93ff8abb2c0706ee90b"}  # mccnn 1.4.1
_LAYERS = (0, 1), (3, 4), (6, 7), (9, 10), (12, 13)  # the numbers of their two convolutions
_BLOCK = 32  # rows that are computed at once: what they take fits a cache


@frozen(eq=False)
class Layer:
    """One layer: of each channel and of all channels.

    Parameters
    ----------
    own, own_bias
        (channels, 3, 3) and (channels,) weights of each channel's neighbours.
    mix, mix_bias
        (channels out, channels in) and (channels out,).
    """

    own: NDArray[np.float32]
    own_bias: NDArray[np.float32]
    mix: NDArray[np.float32]
    mix_bias: NDArray[np.float32]


def weights_file() -> Path | None:
    """The file of weights in the installed package; None if it is not installed."""
    spec = find_spec("mc_cnn")  # looks for it without importing it
    folders = spec.submodule_search_locations if spec is not None else None
    return Path(next(iter(folders))) / _FILE if folders else None


def installed(_: object, attribute: Any, value: object) -> None:
    """Validator: ``mccnn`` takes the package."""
    if value == "mccnn" and weights_file() is None:
        raise ValueError(f"{attribute.name} is mccnn, which takes the package of its weights: {INSTALL}")


@cache
def network() -> tuple[Layer, ...]:
    """The five layers.

    Raises
    ------
    UserError
        If the package is not installed, or its weights are others than those known here: results would differ.
    """
    path = weights_file()
    if path is None or not path.is_file():
        raise UserError(f"similarity=mccnn needs the weights in the package mccnn, which is not installed: {INSTALL}")
    if sha256(path.read_bytes()).hexdigest() not in _DIGESTS:
        raise UserError(f"the weights {path} are not those of mccnn 1.4.1: pip install 'mccnn==1.4.1'")
    return layers(read_model(path).tensors)


def layers(tensors: Mapping[str, NDArray[np.float32]]) -> tuple[Layer, ...]:
    """The layers made of named weights."""

    def of(number: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        return tensors[f"conv_blocks.{number}.weight"], tensors[f"conv_blocks.{number}.bias"]

    found = []
    for one, other in _LAYERS:
        (own, own_bias), (mix, mix_bias) = of(one), of(other)
        found.append(Layer(np.ascontiguousarray(own[:, 0]), own_bias, np.ascontiguousarray(mix[:, :, 0, 0]), mix_bias))
    return tuple(found)


@kernel
def convolve(values, weights, bias, out):  # type: ignore[no-untyped-def]
    """out (channels, h - 2, w - 2) = each channel's own 3x3 weights over (channels, h, w) values, plus its bias."""
    for c in range(out.shape[0]):
        for y in range(out.shape[1]):
            row = out[c, y]
            for x in range(row.size):
                total = bias[c]
                for dy in range(3):
                    for dx in range(3):
                        total += weights[c, dy, dx] * values[c, y + dy, x + dx]
                row[x] = total


@kernel
def shorten(values, steps, out):  # type: ignore[no-untyped-def]
    """out (h, w, channels) int8 = (channels, h, w) values over their length, in so many steps; 0 where it is 0."""
    channels, height, width = values.shape
    for y in range(height):
        for x in range(width):
            length = np.float32(0)
            for c in range(channels):
                length += values[c, y, x] * values[c, y, x]
            scale = steps / np.sqrt(length) if length > 0 else np.float32(0)
            for c in range(channels):
                out[y, x, c] = np.int8(np.rint(values[c, y, x] * scale))


def describe(image: NDArray[np.float32], network: tuple[Layer, ...], out: NDArray[np.int8], threads: int = 1) -> None:
    """out (H, W, 64) int8 = the descriptors of all pixels, in 127ths. The same for any number of threads.

    Parameters
    ----------
    image
        (H, W) float32, normalised. Beyond its edges the edge's pixels repeat.
    """
    wide = np.pad(image, RADIUS, mode="edge")

    def rows(first: int, end: int) -> None:
        values = wide[None, first : end + 2 * RADIUS]
        for number, layer in enumerate(network):
            channels, height, width = values.shape
            near = np.empty((channels, height - 2, width - 2), np.float32)
            convolve(values, layer.own, layer.own_bias, near)
            mixed = layer.mix @ near.reshape(channels, -1)
            mixed += layer.mix_bias[:, None]
            if number + 1 < len(network):
                np.maximum(mixed, 0, out=mixed)
            values = mixed.reshape(-1, height - 2, width - 2)
        shorten(values, np.float32(STEPS), out[first:end])

    # each block is one matrix, multiplied by one thread: so that sums do not depend on the number of threads
    with threadpool_limits(1, "blas"):
        over_rows(rows, len(image), threads, _BLOCK)


def descriptors(grey: NDArray[np.float32], fineness: int, threads: int = 1) -> NDArray[np.int8]:
    """(views, H, q W, 64) int8: the descriptors of all samples of a row, in 127ths.

    A sample between pixels is described as a pixel of the image that is shifted so far.

    Parameters
    ----------
    grey
        (views, H, q (W - 1) + 1) luma, sampled at the fineness q. What is beyond the last pixel is 0 in the answer.
    """
    views, height, samples = grey.shape
    width = (samples - 1) // fineness + 1
    found = np.zeros((views, height, width, fineness, CHANNELS), np.int8)
    known = network()
    for view, rows in enumerate(grey):
        pixels = rows[:, ::fineness]
        deviation = pixels.std(dtype=np.float64) or 1.0
        normal = np.asarray((rows - pixels.mean(dtype=np.float64)) / deviation, np.float32)
        for phase in range(fineness):
            part = np.ascontiguousarray(normal[:, phase::fineness])
            if part.shape[1]:
                each = np.empty((*part.shape, CHANNELS), np.int8)
                describe(part, known, each, threads)
                found[view, :, : part.shape[1], phase] = each
    return found.reshape(views, height, width * fineness, CHANNELS)
