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
BAND = 64  # lines that are walked side by side

# what is summed over the neighbours of a pixel: their weights, also times their distances from it along the lines (A)
# and across them (B), and times their disparities
ONE, D, AB, A, AA, AD, B, BB, BD = range(9)
PARTS = 9
TURNED = (ONE, D, AB, B, BB, BD, A, AA, AD)  # the same with the other lines: what was along is across


@helper
def _carry(own, before, weight, out):  # type: ignore[no-untyped-def]
    """out = own + weight * the sums of the pixels before."""
    for x in range(out.size):
        out[x] = own[x] + weight[x] * before[x]


@helper
def _carry_along(own, before, lower, weight, step, out):  # type: ignore[no-untyped-def]
    """The same with distances, which are a `step` less from here; `lower` has one of them less in its product."""
    for x in range(out.size):
        out[x] = own[x] + weight[x] * (before[x] - step * lower[x])


@helper
def _carry_square(own, before, lower, ones, weight, step, out):  # type: ignore[no-untyped-def]
    """The same with squares of distances."""
    for x in range(out.size):
        out[x] = own[x] + weight[x] * (before[x] - step * (lower[x] + lower[x]) + ones[x])


@helper
def _carry_all(own, before, weight, step, out):  # type: ignore[no-untyped-def]
    """out = own + weight * all sums of the pixels before, as seen from here."""
    for c in (ONE, D, B, BB, BD):
        _carry(own[c], before[c], weight, out[c])
    for c, lower in ((AB, B), (A, ONE), (AD, D)):
        _carry_along(own[c], before[c], before[lower], weight, step, out[c])
    _carry_square(own[AA], before[AA], before[A], before[ONE], weight, step, out[AA])


@helper
def _copy(values, row):  # type: ignore[no-untyped-def]
    for x in range(row.size):
        row[x] = values[x]


@helper
def _add_others(all_after, own, row):  # type: ignore[no-untyped-def]
    """row += all_after - own: what the pixel itself adds is in the row already."""
    for x in range(row.size):
        row[x] += all_after[x] - own[x]


@helper
def _walk(sums, links, behind, out):  # type: ignore[no-untyped-def]
    """out = the sums of all pixels of a line, each by the product of the links between it and the pixel.

    Parameters
    ----------
    sums
        (pixels of a line, 9, lines) float32 in the order of the constants above, each as seen from its own pixel.
    links
        (pixels of a line, lines) float32 weight of the step from the pixel before.
    behind
        (2, 9, lines) for the sums of a pixel and those after it.
    """
    pixels, step = sums.shape[0], np.float32(1)
    for c in range(PARTS):
        _copy(sums[0, c], out[0, c])
        _copy(sums[pixels - 1, c], behind[(pixels - 1) % 2, c])
    for p in range(1, pixels):
        _carry_all(sums[p], out[p - 1], links[p], step, out[p])
    for p in range(pixels - 2, -1, -1):
        _carry_all(sums[p], behind[(p + 1) % 2], links[p + 1], -step, behind[p % 2])
        for c in range(PARTS):
            _add_others(behind[p % 2, c], sums[p, c], out[p, c])


@kernel
def along_columns(sums, links):  # type: ignore[no-untyped-def]
    """Sums along columns take the place of `sums` (H, 9, W), each as seen from its own pixel; `links` are (H, W)."""
    height, _, width = sums.shape
    summed, behind = np.empty((height, PARTS, BAND), np.float32), np.empty((2, PARTS, BAND), np.float32)
    for left in range(0, width, BAND):
        lines = slice(left, min(left + BAND, width))
        count = lines.stop - left
        _walk(sums[:, :, lines], links[:, lines], behind[:, :, :count], summed[:, :, :count])
        for row in range(height):
            for c in range(PARTS):
                _copy(summed[row, c, :count], sums[row, c, lines])


@kernel
def along_rows(sums, links):  # type: ignore[no-untyped-def]
    """The same along the rows, some of which are turned into columns at a time; `links` are (W, H)."""
    height, _, width = sums.shape
    turned, summed = np.empty((width, PARTS, BAND), np.float32), np.empty((width, PARTS, BAND), np.float32)
    behind = np.empty((2, PARTS, BAND), np.float32)
    for top in range(0, height, BAND):
        count = min(BAND, height - top)
        for c in range(PARTS):
            for x in range(width):
                for line in range(count):
                    turned[x, TURNED[c], line] = sums[top + line, c, x]
        _walk(turned[:, :, :count], links[:, top : top + count], behind[:, :, :count], summed[:, :, :count])
        for c in range(PARTS):
            for line in range(count):
                for x in range(width):
                    sums[top + line, c, x] = summed[x, TURNED[c], line]


@helper
def _planes_of(one, d, ab, a, aa, ad, b, bb, bd, out):  # type: ignore[no-untyped-def]
    steady = np.float32(STEADY)
    for x in range(out.size):
        a_, b_, d_ = a[x] / one[x], b[x] / one[x], d[x] / one[x]
        aa_, bb_ = aa[x] / one[x] - a_ * a_ + steady, bb[x] / one[x] - b_ * b_ + steady
        ab_, ad_, bd_ = ab[x] / one[x] - a_ * b_, ad[x] / one[x] - a_ * d_, bd[x] / one[x] - b_ * d_
        slopes = (ad_ * bb_ - bd_ * ab_) * a_ + (bd_ * aa_ - ad_ * ab_) * b_
        out[x] = d_ - slopes / (aa_ * bb_ - ab_ * ab_)


@kernel
def planes_at(sums, out):  # type: ignore[no-untyped-def]
    """out (H, W) = what the plane of least weighted squares through the neighbours of a pixel says of the pixel."""
    for row in range(out.shape[0]):
        s = sums[row]
        _planes_of(s[ONE], s[D], s[AB], s[A], s[AA], s[AD], s[B], s[BB], s[BD], out[row])


@helper
def _link(image, found, fall, y, x, v, u):  # type: ignore[no-untyped-def]
    """The weight of a step between two pixels."""
    contrast = np.int64(0)
    for c in range(image.shape[2]):
        contrast = max(contrast, abs(np.int64(image[y, x, c]) - np.int64(image[v, u, c])))
    near = abs(found[y, x] - found[v, u]) <= np.float32(JUMP)
    return fall[contrast] * (np.float32(1) if near else np.float32(ACROSS))


@kernel
def link(image, found, fall, along, down):  # type: ignore[no-untyped-def]
    """Weight of a step from the pixel before: in a row (`along`, (W, H)), and in a column (`down`, (H, W)).

    `fall` has the weights by contrast, the largest difference over the colours; a jump makes them less.
    """
    height, width = found.shape
    for y in range(height):
        for x in range(width):
            along[x, y] = _link(image, found, fall, y, x, y, x - 1) if x > 0 else np.float32(0)
            down[y, x] = _link(image, found, fall, y, x, y - 1, x) if y > 0 else np.float32(0)


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
    along, down = np.empty(found.T.shape, np.float32), np.empty(found.shape, np.float32)
    link(image, found, np.exp(-np.arange(256) / COLOUR).astype(np.float32), along, down)
    sums = np.zeros((len(found), PARTS, found.shape[1]), np.float32)
    sums[:, ONE], sums[:, D] = sure, sure * found
    for number in range(ROUNDS):
        length = np.float32(np.exp(-(2**number) / REACH))
        along_rows(sums, along * length)
        along_columns(sums, down * length)
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
