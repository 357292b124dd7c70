"""Similarities ``mixed`` of single pixels: what `windows.pair_rows` finds with a window of one, in whole numbers.

All pairs of a row are compared while the row is in the cache, and the planes of one phase one after another.
"""

import numpy as np

from matbench.algorithms.features import CENSUS_BITS, UNITS
from matbench.algorithms.kernels import fill, helper, inlined, kernel
from matbench.algorithms.windows import (
    COLOUR,
    COLOUR_SPAN,
    FULL,
    ORDER,
    ORDER_SPAN,
    SLOPE,
    SLOPE_SPAN,
    count_differing,
    count_differing_among,
)

PIXELS = 32  # are compared at a time: rows of features have as many to spare

# whole numbers that a cost of 1 is worth: so many that a unit of a slope costs 15, and one of three colours 3 1/2
WORTH = round(15 * SLOPE_SPAN * UNITS / SLOPE)
OF_BYTE = round(FULL * 128 * 65536 / WORTH)  # from these to 128ths of a byte, in 65536ths
# each channel costs whole numbers and a half: 3 1/2 for one of three, 10 1/2 for the only one
HALVES = round(2 * WORTH * COLOUR / COLOUR_SPAN / UNITS)


@helper
def _order(differing, compared, masked, out):  # type: ignore[no-untyped-def]
    """out = the cost of the census in whole numbers, see `windows._census_difference`."""
    unit, most, bits = np.float32(ORDER * WORTH / ORDER_SPAN), np.float32(ORDER_SPAN), np.float32(CENSUS_BITS)
    half = np.float32(0.5)
    for x in range(np.uintp(out.size)):
        differ = np.float32(differing[x])
        if len(masked) > 0:
            differ = bits * differ / np.float32(compared[x])
        out[x] = np.uint16(np.int32(unit * min(differ, most) + half))


@inlined
def _similar(  # type: ignore[no-untyped-def]
    left, right, left_slope, right_slope, order, fi, ui, fj, uj, row, channels, limit, out
):
    """out = 255 - 255 times the cost of ``mixed``, rounded; `limit` is the largest sum of colour differences."""
    kind, one, seven, sixteen = np.uint16, np.uint16(1), np.uint16(7), np.uint32(16)
    whole, slope, most = kind(HALVES // len(channels) // 2), kind(15), kind(SLOPE_SPAN * UNITS)
    worth, half, byte = kind(WORTH), kind(64), np.uint32(OF_BYTE)
    for x in range(np.uintp(out.size)):
        i, j = x + np.uintp(ui), x + np.uintp(uj)
        total = kind(0)
        for c in range(len(channels)):
            a, b = left[fi, c, row, i], right[fj, c, row, j]
            total = kind(total + kind(max(a, b) - min(a, b)))
        total = min(total, limit)
        a, b = left_slope[fi, row, i], right_slope[fj, row, j]
        steep = min(kind(max(a, b) - min(a, b)), most)
        cost = kind(kind(total * whole) + kind(total >> one))
        cost = min(cost, worth)
        cost = kind(cost + kind(steep * slope))
        cost = min(kind(cost + order[x]), worth)
        in_byte = kind((np.uint32(kind(worth - cost)) * byte) >> sixteen)
        out[x] = np.uint8(kind(in_byte + half) >> seven)


@helper
def _copy(values, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):
        out[x] = values[x]


@kernel
def compare_pixels(features, pairs, masked, channels, limit, spans, y0, out):  # type: ignore[no-untyped-def]
    """Similarities of all pairs for the rows y0, y0 + 1, ... of `out` (rows, pairs, planes, columns), overwritten.

    Parameters
    ----------
    features
        `Features`, sorted by phase, with `PIXELS` columns to spare.
    pairs
        (pairs, 2) views.
    masked, channels
        As in `Criterion`.
    limit
        As in `Criterion`, in whole numbers (`whole`), and at most what alone costs 1.
    spans
        (pairs, planes, 6) first column in `out` and number of columns, then phase and sample where they start in
        either view.
    """
    phases, samples = features.rows.shape[1], features.rows.shape[4]
    differing, compared = np.zeros(samples, np.uint8), np.zeros(samples, np.uint8)
    order, similar = np.zeros(samples, np.uint16), np.zeros(samples, np.uint8)
    zero = np.uint8(0)
    for y in range(out.shape[0]):
        row = y0 + y
        for p in range(pairs.shape[0]):
            a, b = pairs[p, 0], pairs[p, 1]
            for first in range(phases):
                for k in range(first, out.shape[2], phases):
                    low, width = spans[p, k, 0], spans[p, k, 1]
                    fi, ui, fj, uj = spans[p, k, 2], spans[p, k, 3], spans[p, k, 4], spans[p, k, 5]
                    if width <= 0:
                        fill(zero, out[y, p, k])
                        continue
                    wide = (width + PIXELS - 1) // PIXELS * PIXELS
                    differ, among = differing[:wide], compared[:wide]
                    if len(masked) > 0:
                        count_differing_among(
                            features.bits[a], features.bits[b], features.masks[a], features.masks[b],
                            fi, ui, fj, uj, row, differ, among,
                        )  # fmt: skip
                    else:
                        count_differing(features.bits[a], features.bits[b], fi, ui, fj, uj, row, differ)
                    _order(differ, among, masked, order[:wide])
                    _similar(
                        features.rows[a], features.rows[b], features.slopes[a], features.slopes[b], order,
                        fi, ui, fj, uj, row, channels, limit, similar[:wide],
                    )  # fmt: skip
                    fill(zero, out[y, p, k, :low])
                    _copy(similar, out[y, p, k, low : low + width])
                    fill(zero, out[y, p, k, low + width :])


def most_costly(channels: int, truncation: float) -> np.uint16:
    """The largest sum of colour differences that is told apart, in whole numbers: at most what alone costs 1."""
    alone = 2 * WORTH * channels / HALVES
    return np.uint16(min(truncation * channels * UNITS if truncation else np.inf, np.ceil(alone)))
