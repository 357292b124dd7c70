"""Similarities of windows in one pair of views (docs/concepts/methods.md), plane by plane and row by row.

At a point, sample `x + ui` of phase `fi` of one view is compared with sample `x + uj` of phase `fj` of the
other. Offsets are unsigned: signed ones might count from an array's end, which keeps loops from being
vectorised.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.features import CENSUS_BITS, CENSUS_WORDS, UNITS
from matbench.algorithms.kernels import fill, helper, inlined, kernel, popcount
from matbench.algorithms.mccnn import CHANNELS, STEPS

FULL = 255  # a stored similarity of 1: similarities are kept in one byte
COLOUR, SLOPE, ORDER = 0.35, 0.25, 0.40  # weights of the three costs of ``mixed``
COLOUR_SPAN, SLOPE_SPAN, ORDER_SPAN = 20.0, 10.0, 20.0  # differences that cost the whole weight
SQUARES, CENSUS, MIXED, LEARNED = range(4)  # what is averaged over a window
EXPONENTIAL, ROOT, LINEAR = range(3)  # how the mean becomes a similarity
TILE = 4  # planes


class Features(NamedTuple):
    """The features of the views, or of one view without the first axis; samples are sorted by `by_phase`.

    Parameters
    ----------
    rows
        (views, phases, channels, H, samples) colours or luma: float32, in grey levels, or for ``mixed`` uint16
        (`whole`).
    slopes
        (views, phases, H, samples) uint16 horizontal gradients of the luma (`whole`).
    bits, masks
        (views, phases, words, H, samples) uint8: census of the luma, and which of its pixels are likely
        on the same surface as the middle one.
    descriptors
        (views, H, all samples, 64) int8, see `mccnn.descriptors`; not sorted, as each is read as a whole.
    """

    rows: NDArray[np.float32] | NDArray[np.uint16]
    slopes: NDArray[np.uint16]
    bits: NDArray[np.uint8]
    masks: NDArray[np.uint8]
    descriptors: NDArray[np.int8]

    def of(self, view: int) -> "Features":
        """Those of one view."""
        return Features(*(part[view] for part in self))


class Criterion(NamedTuple):
    """How two windows are compared.

    Parameters
    ----------
    measure, shape
        Which differences are averaged (`SQUARES`, ...), and how their mean becomes a similarity (`LINEAR`, ...).
    rate
        How fast the similarity falls, exponentially or linearly.
    limit
        The largest colour difference of a pixel that counts: a mean of squares, or a sum of absolute values.
    masked
        Empty to compare all bits of the census; else only those set in the `masks` of both views.
    channels, taps
        Tuples as long as there are channels, and taps along a side of the window. Their lengths are known to the
        compiler, so that it can unroll loops.
    apart
        How many samples lie from a column to the next, where `descriptors` are compared.
    """

    measure: int
    shape: int
    rate: float
    limit: np.float32
    masked: tuple[int, ...]
    channels: tuple[int, ...]
    taps: tuple[int, ...]
    apart: int


@helper
def square_difference(left, right, fi, ui, fj, uj, row, channels, limit, out):  # type: ignore[no-untyped-def]
    """out = min(mean over the channels of (a - b)^2, limit); the tuple `channels` is as long as there are."""
    share, zero = np.float32(1 / len(channels)), np.float32(0)
    for x in range(np.uintp(out.size)):
        total = zero
        for c in range(len(channels)):
            gap = left[fi, c, row, x + np.uintp(ui)] - right[fj, c, row, x + np.uintp(uj)]
            total += gap * gap
        out[x] = min(total * share, limit)


@helper
def count_differing(left, right, fi, ui, fj, uj, row, differing):  # type: ignore[no-untyped-def]
    """How many of the census bits of two pixels differ."""
    kind = np.uint8
    for x in range(np.uintp(differing.size)):
        i, j = x + np.uintp(ui), x + np.uintp(uj)
        count = kind(0)
        for word in range(CENSUS_WORDS):
            count = kind(count + popcount(kind(left[fi, word, row, i] ^ right[fj, word, row, j])))
        differing[x] = count


@inlined
def count_differing_among(  # type: ignore[no-untyped-def]
    left, right, left_masks, right_masks, fi, ui, fj, uj, row, differing, compared
):
    """How many bits differ among those that are set in the masks of both views, and how many these are."""
    kind = np.uint8
    for x in range(np.uintp(differing.size)):
        i, j = x + np.uintp(ui), x + np.uintp(uj)
        differ, among = kind(0), kind(0)
        for word in range(CENSUS_WORDS):
            both = kind(left_masks[fi, word, row, i] & right_masks[fj, word, row, j])
            unlike = kind((left[fi, word, row, i] ^ right[fj, word, row, j]) & both)
            differ, among = kind(differ + popcount(unlike)), kind(among + popcount(both))
        differing[x], compared[x] = differ, among


@helper
def _census_difference(differing, compared, masked, out):  # type: ignore[no-untyped-def]
    """out = min(h, 20) / 20, with h how many of 48 bits differ; of fewer compared ones, scaled up to 48."""
    share, most, bits = np.float32(1 / ORDER_SPAN), np.float32(ORDER_SPAN), np.float32(CENSUS_BITS)
    for x in range(np.uintp(out.size)):
        differ = np.float32(differing[x])
        if len(masked) > 0:
            differ = bits * differ / np.float32(compared[x])
        out[x] = share * min(differ, most)


@inlined
def _mixed_difference(  # type: ignore[no-untyped-def]
    left, right, left_slope, right_slope, differing, compared, fi, ui, fj, uj, row, masked, channels, limit, out
):
    """out = the cost of ``mixed`` at every pixel, between 0 and 1 unless `limit` allows more."""
    colour, slope = np.float32(COLOUR / COLOUR_SPAN / len(channels) / UNITS), np.float32(SLOPE / SLOPE_SPAN / UNITS)
    order, steepest, kind = np.float32(ORDER / ORDER_SPAN), np.float32(SLOPE_SPAN * UNITS), np.uint16
    most, bits, farthest = np.float32(ORDER_SPAN), np.float32(CENSUS_BITS), limit * np.float32(UNITS)
    for x in range(np.uintp(out.size)):
        i, j = x + np.uintp(ui), x + np.uintp(uj)
        total = kind(0)  # of three channels it is less than 65536: each has less than 320 levels
        for c in range(len(channels)):
            a, b = left[fi, c, row, i], right[fj, c, row, j]
            total = kind(total + kind(max(a, b) - min(a, b)))
        a, b = left_slope[fi, row, i], right_slope[fj, row, j]
        steep, differ = np.float32(kind(max(a, b) - min(a, b))), np.float32(differing[x])
        if len(masked) > 0:
            differ = bits * differ / np.float32(compared[x])
        out[x] = colour * min(np.float32(total), farthest) + slope * min(steep, steepest) + order * min(differ, most)


@helper
def _angle(left, right, fi, ui, fj, uj, apart, row, out):  # type: ignore[no-untyped-def]
    """out = min(1 - f g, 1): descriptors that are at right angles, or further apart, have nothing in common."""
    zero, one, share = np.float32(0), np.float32(1), np.float32(1 / STEPS**2)
    for x in range(np.uintp(out.size)):
        one_of, other = left[row, (x + ui) * apart + fi], right[row, (x + uj) * apart + fj]
        total = np.int32(0)
        for c in range(CHANNELS):
            total += np.int32(one_of[c]) * np.int32(other[c])
        out[x] = min(max(one - share * np.float32(total), zero), one)


@helper
def _sum_rows(ring, taps, out):  # type: ignore[no-untyped-def]
    """out = sum of all rows of `ring`; the tuple `taps` is as long as there are rows."""
    zero = np.float32(0)
    for x in range(np.uintp(out.size)):
        total = zero
        for row in range(len(taps)):
            total += ring[row, x]
        out[x] = total


@helper
def _exponential(column, taps, apart, weight, share, rate, root, out):  # type: ignore[no-untyped-def]
    """exp(-rate mean) in 255ths, or exp(-rate sqrt(mean)) with `root`; the mean is that of `_complement`.

    exp(-z) = p(z / 16)^16 with p the Taylor polynomial of exp(-w) of degree 4: right within a
    thousandth of a 255th. Beyond z = 6.4 the result is below half a 255th.
    """
    zero, most, one = np.float32(0), np.float32(0.4), np.float32(1)
    half, full, sixteenth = np.float32(0.5), np.float32(FULL), np.float32(rate / 16)
    a2, a3, a4 = np.float32(1 / 2), np.float32(-1 / 6), np.float32(1 / 24)
    for x in range(np.uintp(out.size)):
        total = zero
        for tap in range(len(taps)):
            total += column[x + np.uintp(tap * apart)]
        mean = total * (weight[x] * share)
        w = min(sixteenth * (np.sqrt(mean) if root else mean), most)
        power = one + w * (w * (a2 + w * (a3 + w * a4)) - one)
        power *= power
        power *= power
        power *= power
        out[x] = np.uint8(np.int32(full * power * power + half))


@helper
def _complement(column, taps, apart, weight, share, rate, out):  # type: ignore[no-untyped-def]
    """1 - rate mean in 255ths; the mean is share weight times the sum over taps `apart` columns from one another."""
    zero, half, full, fall = np.float32(0), np.float32(0.5), np.float32(FULL), np.float32(FULL * rate)
    for x in range(np.uintp(out.size)):
        total = zero
        for tap in range(len(taps)):
            total += column[x + np.uintp(tap * apart)]
        out[x] = np.uint8(np.int32(max(full - fall * (total * (weight[x] * share)), zero) + half))


@helper
def _tap_shares(fineness, radius, width, weight):  # type: ignore[no-untyped-def]
    """weight = 1 over how many columns of a window lie within a row of `width` samples."""
    most = np.float32(1 / (2 * radius + 1))
    for x in range(width):
        weight[x] = most
    for edge in range(min(radius * fineness, width)):
        for x in (edge, width - 1 - edge):
            taps = min(radius, x // fineness) + min(radius, (width - 1 - x) // fineness) + 1
            weight[x] = np.float32(1 / taps)


@kernel
def pair_rows(left, right, criterion, spans, fineness, y0, p, out):  # type: ignore[no-untyped-def]
    """Similarities of pair p for the rows y0, y0 + 1, ... of `out` (rows, pairs, planes, columns).

    Differences of a row are computed once and kept while windows of the plane need them; taps that
    leave a frame of either view are left out of the mean.

    Parameters
    ----------
    left, right
        `Features` of the pair's views.
    criterion
        `Criterion`.
    spans
        (planes, 6) first column in `out` and number of columns, then phase and sample where they
        start in either view.
    fineness
        Samples from tap to tap.
    """
    height, samples = left.rows.shape[2], left.rows.shape[3]
    measure, shape, rate, limit, masked, channels, taps, apart = criterion
    side = len(taps)
    radius = side // 2
    reach = radius * fineness
    # planes are taken a few at a time: their windows' rows stay near, and `out` is written in long runs
    ring = np.zeros((TILE, side, samples), np.float32)
    weights = np.empty((TILE, samples), np.float32)
    column = np.zeros(samples + 2 * reach, np.float32)
    differing, compared = np.empty(samples, np.uint8), np.empty(samples, np.uint8)
    zero = np.float32(0)
    for nearest in range(TILE, out.shape[2] + TILE, TILE):
        tile = range(nearest - TILE, min(nearest, out.shape[2]))
        for k in tile:
            _tap_shares(fineness, radius, spans[k, 1], weights[k % TILE])
        for row in range(y0 - radius, y0 + out.shape[0] + radius):
            y = row - radius
            share = np.float32(1 / (min(height, y + radius + 1) - max(0, y - radius))) if y >= y0 else zero
            for k in tile:
                low, width = spans[k, 0], spans[k, 1]
                fi, ui, fj, uj = spans[k, 2], spans[k, 3], spans[k, 4], spans[k, 5]
                if width <= 0:
                    continue
                near = ring[k % TILE]
                cost = near[row % side, :width]
                if row < 0 or row >= height:
                    fill(zero, cost)
                elif measure == SQUARES:
                    square_difference(left.rows, right.rows, fi, ui, fj, uj, row, channels, limit, cost)
                elif measure == LEARNED:
                    _angle(left.descriptors, right.descriptors, fi, ui, fj, uj, apart, row, cost)
                else:
                    differ, among = differing[:width], compared[:width]
                    if len(masked) > 0:
                        count_differing_among(
                            left.bits, right.bits, left.masks, right.masks, fi, ui, fj, uj, row, differ, among
                        )
                    else:
                        count_differing(left.bits, right.bits, fi, ui, fj, uj, row, differ)
                    if measure == CENSUS:
                        _census_difference(differ, among, masked, cost)
                    else:
                        # no whole tuples: with more arrays the compiler gives up checking that they do not overlap
                        _mixed_difference(
                            left.rows, right.rows, left.slopes, right.slopes, differ, among, fi, ui, fj, uj, row,
                            masked, channels, limit, cost,
                        )  # fmt: skip
                if y < y0:
                    continue
                _sum_rows(near, taps, column[reach : reach + width])
                fill(zero, column[reach + width : 2 * reach + width])
                similar = out[y - y0, p, k, low : low + width]
                if shape == LINEAR:
                    _complement(column, taps, fineness, weights[k % TILE], share, rate, similar)
                else:
                    _exponential(column, taps, fineness, weights[k % TILE], share, rate, shape == ROOT, similar)
