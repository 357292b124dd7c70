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


@inlined
def _compare_span(  # type: ignore[no-untyped-def]
    features, a, b, masked, channels, limit, fi, ui, fj, uj, row, differ, among, order, similar
):
    """Similarities of some columns, as many as `similar` has: a multiple of `PIXELS`."""
    # no whole tuples are handed on: with more arrays the compiler gives up checking that they do not overlap
    if len(masked) > 0:
        count_differing_among(
            features.bits[a], features.bits[b], features.masks[a], features.masks[b], fi, ui, fj, uj, row, differ, among
        )
    else:
        count_differing(features.bits[a], features.bits[b], fi, ui, fj, uj, row, differ)
    _order(differ, among, masked, order)
    _similar(
        features.rows[a], features.rows[b], features.slopes[a], features.slopes[b], order, fi, ui, fj, uj, row,
        channels, limit, similar,
    )  # fmt: skip


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
                    _compare_span(
                        features, a, b, masked, channels, limit, fi, ui, fj, uj, row, differing[:wide],
                        compared[:wide], order[:wide], similar[:wide],
                    )  # fmt: skip
                    fill(zero, out[y, p, k, :low])
                    _copy(similar, out[y, p, k, low : low + width])
                    fill(zero, out[y, p, k, low + width :])


@helper
def _least(values, least):  # type: ignore[no-untyped-def]
    """least = the smallest of every `PIXELS` values."""
    for block in range(least.size):
        here = values[block * PIXELS]
        for x in range(block * PIXELS + 1, min(values.size, (block + 1) * PIXELS)):
            here = min(here, values[x])
        least[block] = here


@helper
def _see(found, k, similar, total, reached, ended):  # type: ignore[no-untyped-def]
    """Adds a view's V (1 - rho), V and w at plane k, see `fusion.sight`, to the sums over the views."""
    zero, one, two, plane, scale = np.float32(0), np.float32(1), np.float32(2), np.float32(k), np.float32(1 / FULL)
    for x in range(found.size):
        behind = plane - found[x]
        through = min(max(behind + two, zero), one)
        total[x] += through * (one - scale * np.float32(similar[x]))
        reached[x] += through
        ended[x] += max(one - abs(behind), zero)


@helper
def _share_out(total, reached, ended, material):  # type: ignore[no-untyped-def]
    for x in range(total.size):
        total[x] /= reached[x]
        material[x] = ended[x] / reached[x]


@kernel
def weigh_pixels(  # type: ignore[no-untyped-def]
    features, maps, view, masked, channels, limit, spans, fineness, y0, prior, ended_before, hidden, cost, material
):
    """What `fusion.weigh_seen` finds for pairs of the reference view, comparing only pixels that see a point.

    Parameters
    ----------
    features, masked, channels, limit
        As in `compare_pixels`.
    maps, view, fineness, hidden, cost, material
        As in `fusion.weigh_seen`.
    spans
        (views, planes, 6) as there; row `view` is not read.
    prior, ended_before
        What is assumed before any view is asked: `agreement.PRIOR` and `agreement.ENDED`.
    """
    views, _, width = maps.shape
    samples = features.rows.shape[4]
    differing, compared = np.zeros(samples, np.uint8), np.zeros(samples, np.uint8)
    order, similar = np.zeros(samples, np.uint16), np.zeros(samples, np.uint8)
    reached, ended = np.empty(width, np.float32), np.empty(width, np.float32)
    least = np.empty((views, (width + PIXELS - 1) // PIXELS), np.float32)
    for y in range(cost.shape[0]):
        row = y0 + y
        for j in range(views):
            _least(maps[j, row], least[j])
        for k in range(cost.shape[1]):
            total = cost[y, k]
            fill(prior * hidden, total)
            fill(prior, reached)
            fill(ended_before, ended)
            seen_from = np.float32(k + 2)  # where rays end nearer than that, V is not 0
            for j in range(views):
                low, count = spans[j, k, 0], spans[j, k, 1]
                if j == view or count <= 0:
                    continue
                fi, ui, fj, uj = spans[j, k, 2], spans[j, k, 3], spans[j, k, 4], spans[j, k, 5]
                # a map has one value a pixel: between two pixels the nearer one is asked
                start = uj + (1 if 2 * fj > fineness else 0)
                begin = 0
                while begin < count:
                    end = begin
                    while end < count:
                        first, last = (start + end) // PIXELS, (start + min(end + PIXELS, count) - 1) // PIXELS
                        if min(least[j, first], least[j, last]) >= seen_from:
                            break
                        end += PIXELS
                    if end > begin:
                        wide, stop = end - begin, min(end, count)
                        _compare_span(
                            features, view, j, masked, channels, limit, fi, ui + begin, fj, uj + begin, row,
                            differing[:wide], compared[:wide], order[:wide], similar[:wide],
                        )  # fmt: skip
                        _see(
                            maps[j, row, start + begin : start + stop],
                            k,
                            similar,
                            total[low + begin : low + stop],
                            reached[low + begin : low + stop],
                            ended[low + begin : low + stop],
                        )
                    begin = end + PIXELS
            _share_out(total, reached, ended, material[y, k])


def most_costly(channels: int, truncation: float) -> np.uint16:
    """The largest sum of colour differences that is told apart, in whole numbers: at most what alone costs 1."""
    alone = 2 * WORTH * channels / HALVES
    return np.uint16(min(truncation * channels * UNITS if truncation else np.inf, np.ceil(alone)))
