"""Features that are compared besides colour: horizontal gradient and census of the luma (docs/concepts/methods.md)."""

import cv2
import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows, over_views

CENSUS_RADIUS = 3  # 7x7 pixels
CENSUS_BITS = (2 * CENSUS_RADIUS + 1) ** 2 - 1
WORD = 8  # bits: bytes are counted fastest, as most of them fit a vector
CENSUS_WORDS = CENSUS_BITS // WORD
UNITS = 64  # of a grey level, where it is kept as a whole number
SHIFTS = 32, 160  # grey levels added to samples and slopes: no cubic overshoot, and no slope, is less than that below 0
LUMA = (0.299, 0.587, 0.114)
AROUND = 2  # pixels to either side in which slopes are alike weak or strong
WEAKEST = 0.2  # grey levels: what hardly slopes at all is noise


def luma(rows: NDArray[np.float32], threads: int = 1) -> NDArray[np.float32]:
    """(views, H, samples) brightness of (views, 3, H, samples) rows, in grey levels."""
    red, green, blue = (np.float32(weight) for weight in LUMA)
    out = np.empty((len(rows), *rows.shape[2:]), np.float32)

    def weigh(view: int, top: int, end: int) -> None:
        r, g, b = rows[view, :, top:end]
        out[view, top:end] = red * r + green * g + blue * b

    over_views(weigh, len(out), out.shape[1], threads)
    return out


def gradient(grey: NDArray[np.float32], fineness: int, threads: int = 1) -> NDArray[np.float32]:
    """Half the difference of the samples one pixel to the right and to the left; the edge's sample repeats beyond."""
    out = np.empty_like(grey)

    def differ(view: int, top: int, end: int) -> None:
        wide = np.pad(grey[view, top:end], ((0, 0), (fineness, fineness)), mode="edge")
        out[view, top:end] = (wide[:, 2 * fineness :] - wide[:, : -2 * fineness]) * np.float32(0.5)

    over_views(differ, len(grey), grey.shape[1], threads)
    return out


def strengthened(slopes: NDArray[np.float32], fineness: int, texture: float, threads: int = 1) -> NDArray[np.float32]:
    """(views, H, samples) slopes times texture / (s + 0.2), where that is more than 1: at most 160 grey levels.

    s is the root mean square of the slopes in the 5x5 pixels around, those beyond an edge mirrored. Often a wall shows
    no texture but one that is hardly visible. So weak slopes are measured by what is usual around them, as by a
    correlation that is normalised by the local contrast. Strong ones stay as they are.

    Parameters
    ----------
    slopes
        (views, H, samples) grey levels for each pixel, from `gradient`.
    fineness
        Samples from pixel to pixel.
    texture
        Grey levels; 0 leaves all slopes as they are.
    """
    if not (slopes.size and texture):
        return slopes
    out = np.empty_like(slopes)
    window = 2 * AROUND * fineness + 1, 2 * AROUND + 1

    def strengthen(view: int, _: int) -> None:
        mean = cv2.blur(slopes[view] * slopes[view], window, borderType=cv2.BORDER_REFLECT)
        usual = np.sqrt(np.maximum(mean, 0)) + np.float32(WEAKEST)
        np.multiply(slopes[view], np.maximum(np.float32(texture) / usual, np.float32(1)), out=out[view])
        np.clip(out[view], -SHIFTS[1], SHIFTS[1], out=out[view])

    over_rows(strengthen, len(out), threads, 1)
    return out


@kernel
def _whole(values, shift, out):  # type: ignore[no-untyped-def]
    units = np.float32(UNITS)
    for x in range(out.size):
        out[x] = np.uint16(np.int32(np.rint((values[x] + shift) * units)))


def whole(values: NDArray[np.float32], shift: float, threads: int = 1) -> NDArray[np.uint16]:
    """Grey levels as whole numbers of `UNITS`, from `shift` below 0 on: twice as many fit a vector."""
    out = np.empty(values.shape, np.uint16)
    over_rows(
        lambda view, _: _whole(values[view].ravel(), np.float32(shift), out[view].reshape(-1)), len(out), threads, 1
    )
    return out


@helper
def _mark_darker(taps, centre, bits):  # type: ignore[no-untyped-def]
    one = np.uint8(1)
    for x in range(centre.size):
        bits[x] = np.uint8(bits[x] << one) | np.uint8(taps[x] < centre[x])


@kernel
def _census(wide, before, top, end, fineness, bits):  # type: ignore[no-untyped-def]
    """Rows top..end of a view; `wide` has rows from `before` on, as many as their windows reach."""
    _, height, samples = bits.shape
    for y in range(top, end):
        number = 0
        for dy in range(-CENSUS_RADIUS, CENSUS_RADIUS + 1):
            row = wide[min(max(y + dy, 0), height - 1) - before]
            middle = CENSUS_RADIUS * fineness
            centre = wide[y - before, middle : middle + samples]
            for dx in range(2 * CENSUS_RADIUS + 1):
                if dy != 0 or dx != CENSUS_RADIUS:
                    taps = row[dx * fineness : dx * fineness + samples]
                    _mark_darker(taps, centre, bits[number // WORD, y])
                    number += 1


def census(grey: NDArray[np.float32], fineness: int, threads: int = 1) -> NDArray[np.uint8]:
    """(views, 6, H, samples) census: one bit for each of the 48 pixels around, set where it is darker.

    The 7x7 pixels are taken row by row from the upper left one, 8 to a word, the first in the
    highest bit. Pixels are `fineness` samples apart; beyond the image's edge its last sample is repeated.
    """
    reach = CENSUS_RADIUS * fineness
    bits = np.zeros((len(grey), CENSUS_WORDS, *grey.shape[1:]), np.uint8)

    def mark(view: int, top: int, end: int) -> None:
        before = max(0, top - CENSUS_RADIUS)
        around = grey[view, before : end + CENSUS_RADIUS]
        wide = np.pad(around, ((0, 0), (reach, reach)), mode="edge")
        _census(wide, before, top, end, fineness, bits[view])

    over_views(mark, len(grey), grey.shape[1], threads)
    return bits


@helper
def _mark_alike(wide, row, other, first, start, most, channels, bits):  # type: ignore[no-untyped-def]
    """Pushes a bit: does no channel of the samples from `start` of the row `other` differ by more than `most`?"""
    kind, one = np.uint16, np.uint8(1)
    for x in range(np.uintp(bits.size)):
        here, there = x + np.uintp(first), x + np.uintp(start)
        gap = kind(0)
        for c in range(len(channels)):
            a, b = wide[c, row, here], wide[c, other, there]
            gap = max(gap, kind(max(a, b) - min(a, b)))
        bits[x] = np.uint8(bits[x] << one) | np.uint8(gap <= most)


@kernel
def _mark_same_surface(wide, before, top, end, fineness, most, channels, bits):  # type: ignore[no-untyped-def]
    """Rows top..end of a view; `wide` has rows from `before` on, as many as their windows reach."""
    height = bits.shape[1]
    middle, any_gap = CENSUS_RADIUS * fineness, np.uint16(65535)
    for y in range(top, end):
        number = 0
        for dy in range(-CENSUS_RADIUS, CENSUS_RADIUS + 1):
            other = min(max(y + dy, 0), height - 1) - before
            for dx in range(-CENSUS_RADIUS, CENSUS_RADIUS + 1):
                if dy == 0 and dx == 0:
                    continue
                limit = any_gap if abs(dx) <= 1 and abs(dy) <= 1 else most
                start = middle + dx * fineness
                _mark_alike(wide, y - before, other, middle, start, limit, channels, bits[number // WORD, y])
                number += 1


def same_surface(rows: NDArray[np.float32], fineness: int, most: float, threads: int = 1) -> NDArray[np.uint8]:
    """(views, 6, H, samples) which of the 48 pixels of a census are likely on the same surface as the middle one.

    A bit is set for each of the eight next to it, and for each whose channels all differ by at most
    `most` grey levels, both rounded to `UNITS`. Across a depth jump pixels move differently between the views, so
    they say nothing about the middle one; their colour tends to differ. Bits are in the order of `census`.

    Parameters
    ----------
    rows
        (views, channels, H, samples) colours or luma.
    """
    reach = CENSUS_RADIUS * fineness
    bits = np.zeros((len(rows), CENSUS_WORDS, *rows.shape[2:]), np.uint8)
    limit, channels = np.uint16(min(round(most * UNITS), 65535)), (0,) * rows.shape[1]

    def mark(view: int, top: int, end: int) -> None:
        before = max(0, top - CENSUS_RADIUS)
        around = whole(rows[view, :, before : end + CENSUS_RADIUS], SHIFTS[0])
        wide = np.pad(around, ((0, 0), (0, 0), (reach, reach)), mode="edge")
        _mark_same_surface(wide, before, top, end, fineness, limit, channels, bits[view])

    over_views(mark, len(rows), rows.shape[2], threads)
    return bits
