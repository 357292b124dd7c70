"""Smooth surfaces through a map: where a pixel is unsure, a plane through surer pixels of its colour takes over."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel

REACH = 50.0  # pixels of a path over which a neighbour's weight falls to 1/e; half of it in the second round
COLOUR = 5.0  # grey levels, added up along a path, over which it falls to 1/e
JUMP, ACROSS = 4.0, 0.02  # pixels of disparity by which pixels of one surface differ at most; weight beyond a jump
SURE = 0.7  # from here on, a pixel keeps its own disparity
LEAST = 0.02  # how sure any pixel is at least
NEAR = 3.0  # pixels of disparity: a plane farther off is another surface
ROUNDS = 2
STEADY = 2.5  # square pixels that are added to the spread of a neighbourhood: few pixels have no slope

# what is summed over the neighbours of a pixel: their weights, also times their distances from it along the lines (A)
# and across them (B), and times their disparities
ONE, D, AB, A, AA, AD, B, BB, BD = range(9)


@helper
def _carry(before, weight, step, out):  # type: ignore[no-untyped-def]
    """out += weight * the sums of the pixel before, as seen from here: distances along the line are a `step` less."""
    out[ONE] += weight * before[ONE]
    out[D] += weight * before[D]
    out[AB] += weight * (before[AB] - step * before[B])
    out[A] += weight * (before[A] - step * before[ONE])
    out[AA] += weight * (before[AA] - step * (before[A] + before[A]) + before[ONE])
    out[AD] += weight * (before[AD] - step * before[D])
    out[B] += weight * before[B]
    out[BB] += weight * before[BB]
    out[BD] += weight * before[BD]


@kernel
def along_paths(sums, links, out):  # type: ignore[no-untyped-def]
    """out = the sums of all pixels of a line, each by the product of the links between it and the pixel.

    Parameters
    ----------
    sums
        (pixels of a line, lines, 9) float32 in the order of the constants above, each as seen from its own pixel.
    links
        (pixels of a line, lines) float32 weight of the step from the pixel before.
    """
    pixels, lines, count = sums.shape
    step = np.float32(1)
    behind, carried = np.zeros((lines, count), np.float32), np.zeros(count, np.float32)
    for p in range(pixels):
        for line in range(lines):
            for c in range(count):
                out[p, line, c] = sums[p, line, c]
            if p > 0:
                _carry(out[p - 1, line], links[p, line], step, out[p, line])
    for p in range(pixels - 1, -1, -1):
        for line in range(lines):
            for c in range(count):
                carried[c] = np.float32(0)
            if p < pixels - 1:
                _carry(behind[line], links[p + 1, line], -step, carried)
            for c in range(count):
                out[p, line, c] += carried[c]
                behind[line, c] = sums[p, line, c] + carried[c]


@kernel
def turn(sums, out):  # type: ignore[no-untyped-def]
    """out (W, H, 9) = sums (H, W, 9) with the other lines: what was along is across."""
    for row in range(sums.shape[0]):
        for column in range(sums.shape[1]):
            part, turned = sums[row, column], out[column, row]
            for c in range(A):
                turned[c] = part[c]
            for c in range(3):
                turned[A + c] = part[B + c]
                turned[B + c] = part[A + c]


@kernel
def planes_at(sums, out):  # type: ignore[no-untyped-def]
    """out (H, W) = what the plane of least weighted squares through the neighbours of a pixel says of the pixel."""
    steady = np.float32(STEADY)
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            part = sums[row, column]
            a, b, d = part[A] / part[ONE], part[B] / part[ONE], part[D] / part[ONE]
            aa, bb = part[AA] / part[ONE] - a * a + steady, part[BB] / part[ONE] - b * b + steady
            ab, ad, bd = part[AB] / part[ONE] - a * b, part[AD] / part[ONE] - a * d, part[BD] / part[ONE] - b * d
            slopes = (ad * bb - bd * ab) * a + (bd * aa - ad * ab) * b
            out[row, column] = d - slopes / (aa * bb - ab * ab)


def _links(lines: NDArray[np.uint8], found: NDArray[np.float32]) -> NDArray[np.float32]:
    """(pixels, lines) weight of a step from the pixel before: exp(-|dI| / COLOUR), and less across a jump."""
    links = np.zeros(found.shape, np.float32)
    contrast = np.abs(np.diff(lines.astype(np.int16), axis=0)).max(axis=-1)
    links[1:] = np.exp(-np.arange(256) / COLOUR).astype(np.float32)[contrast]
    links[1:][np.abs(np.diff(found, axis=0)) > JUMP] *= np.float32(ACROSS)
    return links


def fitted(found: NDArray[np.float32], sure: NDArray[np.float32], image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(H, W) what planes through the neighbours of every pixel say of it.

    A neighbour weighs as much as it is sure, and the less the longer the path to it is and the more the colours change
    along it. A path goes along a row and then along a column, twice (Gastal & Oliveira, "Domain transform for
    edge-aware image and video processing", ACM TOG 30(4), 2011, recursive filtering).

    Parameters
    ----------
    found
        (H, W) float32 disparities in pixels of the field's pair, no NaN.
    sure
        (H, W) float32, more than 0.
    image
        (H, W, 3) uint8.
    """
    along, down = _links(image.swapaxes(0, 1), found.T), _links(image, found)
    sums, summed = np.zeros((*found.shape, 9), np.float32), np.empty((*found.shape, 9), np.float32)
    rows, rows_summed = (np.empty((*found.T.shape, 9), np.float32) for _ in range(2))
    sums[..., ONE], sums[..., D] = sure, sure * found
    for number in range(ROUNDS):
        length = np.float32(np.exp(-(2**number) / REACH))
        turn(sums, rows)
        along_paths(rows, along * length, rows_summed)
        turn(rows_summed, summed)
        along_paths(summed, down * length, sums)
    plane = np.empty_like(found)
    planes_at(sums, plane)
    return plane


def smoothed(found: NDArray[np.float32], sure: NDArray[np.float32], image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(H, W) a map in which unsure pixels lie on the planes that surer ones of their colour span (`fitted`).

    Where texture is weak, semi-global matching makes steps of what is slanted: a step costs the same however large it
    is, and nothing tells where the slope goes on. A plane tells. With c = `sure`, the answer is

    plane + min(1, c / SURE)^2 (found - plane),

    or `found` itself where the plane is `NEAR` pixels off or more.

    Parameters
    ----------
    found
        (H, W) float32 disparities in pixels of the field's pair, no NaN.
    sure
        (H, W) float32 in [0, 1], such as the `peak_ratio`; NaN counts as 0.
    image
        (H, W, 3) uint8.
    """
    known = np.nan_to_num(sure)
    plane = fitted(found, known + np.float32(LEAST), image)
    own = np.minimum(1, known / np.float32(SURE)) ** 2
    near = np.abs(found - plane) < NEAR
    between = np.clip(plane + own * (found - plane), found.min(), found.max())
    return np.where(near, between, found).astype(np.float32)
