"""Mending maps of several views that contradict one another, from trusted neighbours of the same colour."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.kernels import kernel
from matbench.algorithms.parallel import over_rows

TRUST = 4  # views that must agree with a pixel for each that contradicts it
REACH = 9  # pixels to either side in which neighbours are asked
COLOUR, DISTANCE = 8.0, 9.0  # grey levels and pixels over which their votes fall to 1/e


@kernel
def count_votes(maps, view, tolerance, top, end, agreeing, contradicting):  # type: ignore[no-untyped-def]
    """How many other views agree with each pixel of a view, and how many contradict it.

    View j agrees if its disparity at the column where it should see the point is the same within `tolerance`.
    It contradicts if its disparity there is farther: it would see through the point. If its disparity there is
    nearer, the point is occluded in view j, and the view does not vote.

    Parameters
    ----------
    maps
        (views, H, W) float32 pixels per view step, NaN = no answer.
    agreeing, contradicting
        (H, W) int32, of which the rows top..end are overwritten.
    """
    views, _, width = maps.shape
    for y in range(top, end):
        for x in range(width):
            here = maps[view, y, x]
            agreed, contradicted = 0, 0
            if here == here:  # not NaN
                for j in range(views):
                    at = np.int64(np.floor(x - (j - view) * here + np.float32(0.5)))
                    if j != view and 0 <= at < width:
                        gap = maps[j, y, at] - here
                        if abs(gap) <= tolerance:
                            agreed += 1
                        elif gap < -tolerance:
                            contradicted += 1
            agreeing[y, x] = agreed
            contradicting[y, x] = contradicted


@kernel
def classify(found, trusted, least, step, top, end, places):  # type: ignore[no-untyped-def]
    """(H, W) int32 classes, `step` wide from `least` on, in which disparities lie; -1 where they are not trusted.

    The rows top..end of `places` are overwritten.
    """
    for y in range(top, end):
        for x in range(found.shape[1]):
            places[y, x] = np.int32((found[y, x] - least) / step) if trusted[y, x] else -1


@kernel
def vote(found, image, doubtful, places, colour, distance, least, most, step, top, end, out):  # type: ignore[no-untyped-def]
    """Weighted median of the trusted neighbours of every doubtful pixel.

    Neighbours weigh exp(-|dI| / COLOUR - (|dx| + |dy|) / DISTANCE), with |dI| the largest difference
    over the colours. Votes are counted in classes, and the median is the middle of a
    class, or the largest disparity found if that is less. A pixel within one step of the median, or
    without trusted neighbours, keeps its own disparity.

    Parameters
    ----------
    found
        (H, W) float32 disparities, NaN = none.
    image
        (H, W, 3) uint8.
    doubtful
        (H, W) bool: the pixels to mend.
    places
        Classes of the pixels that may vote (`classify`).
    colour, distance
        (256,) and (REACH + 1,) float32: the weight's factors, by |dI| and by |dx| or |dy|.
    least, most, step
        Least and largest disparity found, and the width of a class, in pixels per view step.
    out
        (H, W) float32, of which the rows top..end are overwritten.
    """
    height, width = found.shape
    reach = distance.size - 1
    near = np.concatenate((distance[:0:-1], distance))  # by column of the window
    votes = np.empty(np.int64((most - least) / step) + 1, np.float32)
    for y in range(top, end):
        for x in range(width):
            out[y, x] = found[y, x]
            if not doubtful[y, x]:
                continue
            votes[:] = 0
            total = np.float32(0)
            first, last = max(0, x - reach), min(width, x + reach + 1)
            skipped = np.uintp(first - (x - reach))
            red, green, blue = np.int64(image[y, x, 0]), np.int64(image[y, x, 1]), np.int64(image[y, x, 2])
            for v in range(max(0, y - reach), min(height, y + reach + 1)):
                apart, classes, colours = distance[abs(v - y)], places[v, first:last], image[v, first:last]
                for u in range(np.uintp(classes.size)):
                    place = classes[u]
                    if place >= 0:
                        gap = max(abs(red - colours[u, 0]), abs(green - colours[u, 1]), abs(blue - colours[u, 2]))
                        weight = colour[np.uintp(gap)] * apart * near[u + skipped]
                        votes[np.uintp(place)] += weight
                        total += weight
            if total > 0:
                place, passed = 0, votes[0]
                while passed < total / 2 and place < votes.size - 1:
                    place += 1
                    passed += votes[place]
                median = min(least + (place + np.float32(0.5)) * step, most)
                if not abs(found[y, x] - median) <= step:  # NaN, too, is replaced
                    out[y, x] = median


def _trusted(
    maps: NDArray[np.float32], view: int, pixel: float, first: bool, threads: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """A view's map, without what is lost in the `first` round, and which of its pixels are trusted (`mend`)."""
    found, shape = maps[view].copy(), maps.shape[1:]
    agreeing, contradicting = np.empty(shape, np.int32), np.empty(shape, np.int32)
    trusted = np.empty(shape, bool)

    def count(top: int, end: int) -> None:
        count_votes(maps, view, np.float32(pixel), top, end, agreeing, contradicting)
        here, yes, no = found[top:end], agreeing[top:end], contradicting[top:end]
        if first:
            here[no > yes] = np.nan
        trusted[top:end] = (no * TRUST <= yes) & ~np.isnan(here)

    over_rows(count, shape[0], threads, 64)
    return found, trusted


def _filled(maps: NDArray[np.float32], threads: int) -> NDArray[np.float32]:
    out = np.empty_like(maps)

    def fill(view: int, _: int) -> None:
        out[view] = fill_from_background(maps[view])

    over_rows(fill, len(maps), threads, 1)
    return out


def mend(
    maps: NDArray[np.float32], images: NDArray[np.uint8], pixel: float, rounds: int, threads: int = 1
) -> NDArray[np.float32]:
    """(views, H, W) maps that agree better with one another; without NaN, except in a view that is all NaN.

    In every round and view, a pixel is trusted if it has an answer, and at least TRUST times as many views agree with
    it as contradict it (`count_votes`). All other pixels are doubtful. In the first round, a pixel loses its answer
    if more views contradict it than agree. Doubtful pixels take the weighted median of their trusted neighbours
    (`vote`). Holes without such neighbours are filled from the background. A view without any trusted pixel is left
    as it is.

    Parameters
    ----------
    maps
        (views, H, W) float32, pixels per view step; NaN = no answer. Left untouched.
    images
        (views, H, W, 3) uint8.
    pixel
        One pixel of the field's pair, in pixels per view step: maps that differ by no more agree.
    rounds
        How often; 0 only fills holes.
    """
    colour = np.exp(np.arange(256) / -COLOUR).astype(np.float32)
    distance = np.exp(np.arange(REACH + 1) / -DISTANCE).astype(np.float32)
    shape = maps.shape[1:]
    for number in range(rounds):
        new = np.empty_like(maps)
        for view, image in enumerate(images):
            found, trusted = _trusted(maps, view, pixel, number == 0, threads)
            if not trusted.any():
                new[view] = maps[view]
                continue

            least, most, step = np.float32(np.nanmin(found)), np.float32(np.nanmax(found)), np.float32(pixel / 2)
            doubtful, places = ~trusted, np.empty(shape, np.int32)

            def place(top: int, end: int) -> None:
                classify(found, trusted, least, step, top, end, places)  # noqa: B023

            over_rows(place, shape[0], threads, 64)

            def ask(top: int, end: int, view: int = view) -> None:
                vote(
                    found, image, doubtful, places, colour, distance, least, most, step, top, end, new[view],  # noqa: B023
                )  # fmt: skip

            over_rows(ask, shape[0], threads)
        maps = _filled(new, threads)
    return maps if rounds else _filled(maps, threads)
