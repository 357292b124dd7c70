"""Smooth surfaces through a map: where a pixel is unsure, a plane through surer pixels of its colour takes over."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel

REACH = 50.0  # pixels of a path over which a neighbour's weight falls to 1/e; half of it in the second round
COLOUR = 5.0  # grey levels, added up along a path, over which it falls to 1/e
JUMP, ACROSS = 4.0, 0.02  # pixels of disparity by which pixels of one surface differ at most; weight beyond a jump
OUTLIER = 1.0  # pixels of disparity from the plane at which a neighbour counts half
SURE = 0.7  # from here on, a pixel keeps its own disparity
LEAST = 0.02  # how sure any pixel is at least
NEAR = 3.0  # pixels of disparity: a plane farther off is another surface
ROUNDS, FITS = 2, 2
STEADY = 2.5  # square pixels that are added to the spread of a neighbourhood: few pixels have no slope

# what is summed over the neighbours of a pixel: their weights, also times their distances x and y from it, and
# times their disparities
ONE, X, Y, XX, XY, YY, D, XD, YD = range(9)
ALONG_ROWS, DOWN_COLUMNS = (X, XX, XD, Y, YY, YD), (Y, YY, YD, X, XX, XD)


@helper
def _carry(before, weight, step, order, out):  # type: ignore[no-untyped-def]
    """out += weight * the sums of the pixel before, as seen from here: distances along the path are a `step` less."""
    a, aa, ad, b, bb, bd = order
    out[ONE] += weight * before[ONE]
    out[a] += weight * (before[a] - step * before[ONE])
    out[aa] += weight * (before[aa] - step * (before[a] + before[a]) + before[ONE])
    out[XY] += weight * (before[XY] - step * before[b])
    out[D] += weight * before[D]
    out[ad] += weight * (before[ad] - step * before[D])
    out[b] += weight * before[b]
    out[bb] += weight * before[bb]
    out[bd] += weight * before[bd]


@kernel
def along_paths(sums, links, order, out):  # type: ignore[no-untyped-def]
    """out = the sums of all pixels of a line, each by the product of the links between it and the pixel.

    Parameters
    ----------
    sums
        (pixels of a line, lines, 9) float32 in the order of the constants above, each as seen from its own pixel.
    links
        (pixels of a line, lines) float32 weight of the step from the pixel before.
    order
        `ALONG_ROWS` or `DOWN_COLUMNS`: which sums are taken along a line.
    """
    pixels, lines, count = sums.shape
    step = np.float32(1)
    behind, carried = np.zeros((lines, count), np.float32), np.zeros(count, np.float32)
    for p in range(pixels):
        for line in range(lines):
            for c in range(count):
                out[p, line, c] = sums[p, line, c]
            if p > 0:
                _carry(out[p - 1, line], links[p, line], step, order, out[p, line])
    for p in range(pixels - 1, -1, -1):
        for line in range(lines):
            for c in range(count):
                carried[c] = np.float32(0)
            if p < pixels - 1:
                _carry(behind[line], links[p + 1, line], -step, order, carried)
            for c in range(count):
                out[p, line, c] += carried[c]
                behind[line, c] = sums[p, line, c] + carried[c]


def _links(lines: NDArray[np.uint8], found: NDArray[np.float32], reach: float) -> NDArray[np.float32]:
    """(pixels, lines) weight of the step from the pixel before: exp(-1 / reach - |dI| / COLOUR), less across a jump."""
    links = np.zeros(found.shape, np.float32)
    contrast = np.abs(np.diff(lines.astype(np.int16), axis=0)).max(axis=-1)
    links[1:] = np.exp(-1 / reach - np.arange(256) / COLOUR).astype(np.float32)[contrast]
    links[1:][np.abs(np.diff(found, axis=0)) > JUMP] *= np.float32(ACROSS)
    return links


def _summed(sums: NDArray[np.float32], links: NDArray[np.float32], order: tuple[int, ...]) -> NDArray[np.float32]:
    out = np.empty_like(sums)
    along_paths(sums, links, order, out)
    return out


def _turned(array: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(array.swapaxes(0, 1))


def fitted(
    found: NDArray[np.float32], sure: NDArray[np.float32], image: NDArray[np.uint8], fits: int = FITS
) -> NDArray[np.float32]:
    """(H, W) what planes through the neighbours of every pixel say of it.

    A neighbour weighs as much as it is sure, and the less the longer the path to it is and the more the colours change
    along it. A path goes along a row and then along a column, twice (Gastal & Oliveira, "Domain transform for
    edge-aware image and video processing", ACM TOG 30(4), 2011, recursive filtering). After a fit, the farther off
    a neighbour's disparity is from its own plane, the less it weighs in the next.

    Parameters
    ----------
    found
        (H, W) float32 disparities in pixels of the field's pair, no NaN.
    sure
        (H, W) float32, more than 0.
    image
        (H, W, 3) uint8.
    """
    turned, turned_image = _turned(found), _turned(image)
    links = [
        (_links(turned_image, turned, REACH / 2**round_), _links(image, found, REACH / 2**round_))
        for round_ in range(ROUNDS)
    ]
    weight, plane = sure, found
    for _ in range(fits):
        sums = np.zeros((*found.shape, 9), np.float32)
        sums[..., ONE], sums[..., D] = weight, weight * found
        for along, down in links:
            sums = _turned(_summed(_turned(sums), along, ALONG_ROWS))
            sums = _summed(sums, down, DOWN_COLUMNS)
        total = sums[..., ONE]
        x, y, d = (sums[..., part] / total for part in (X, Y, D))
        xx, yy = (sums[..., part] / total - mean * mean + np.float32(STEADY) for part, mean in ((XX, x), (YY, y)))
        xy, xd, yd = sums[..., XY] / total - x * y, sums[..., XD] / total - x * d, sums[..., YD] / total - y * d
        determinant = xx * yy - xy * xy
        plane = d - ((xd * yy - yd * xy) * x + (yd * xx - xd * xy) * y) / determinant
        weight = sure / (1 + ((found - plane) / np.float32(OUTLIER)) ** 2)
    return np.asarray(plane, np.float32)


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
