"""Similarities rho_ij of windows in pairs of views, over all target points (SPEC 1)."""

from itertools import combinations, pairwise
from typing import Literal, get_args

import numpy as np
from attrs import field, frozen, validators
from numba import njit
from numpy.typing import NDArray

from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, odd
from matbench.algorithms.sampling import fine_rows, search_space
from matbench.scene import Scene
from matbench.space import DisparitySpace

PairSet = Literal["all", "consecutive"]
Form = Literal["ssd", "rms"]
FLAGS = {"contract", "reassoc", "nsz"}  # lets sums vectorise; NaN and infinity stay honest
FULL = 255  # a stored similarity of 1: similarities are kept in one byte
LEVEL_STEPS = 64  # steps of the table per grey level
LUMA = (0.299, 0.587, 0.114)


def pairs(views: int, which: PairSet) -> NDArray[np.int64]:
    """(pairs, 2) the set r of SPEC 1: ``all`` pairs of views, or the ``consecutive`` ones."""
    chosen = combinations(range(views), 2) if which == "all" else pairwise(range(views))
    return np.array(list(chosen), np.int64)


def falloff(form: Form, sigma: float) -> NDArray[np.uint8]:
    """Similarity in 255ths for root mean square differences of 0, 1/64, 2/64, ... grey levels.

    ``ssd`` is exp(-MSD / sigma^2), ``rms`` is exp(-RMS / sigma). The table ends at its first zero.
    """
    levels = np.arange(LEVEL_STEPS * 512) / (LEVEL_STEPS * sigma)
    table: NDArray[np.uint8] = np.rint(FULL * np.exp(-(levels**2) if form == "ssd" else -levels)).astype(np.uint8)
    return table[: int(np.argmin(table)) + 1].copy()


@njit(nogil=True, cache=True, fastmath=FLAGS)
def _square_difference(a0, a1, a2, b0, b1, b2, limit, out):  # type: ignore[no-untyped-def]
    """out = min(mean over colours of (a - b)^2, limit), for rows of three colours."""
    third = np.float32(1 / 3)
    for x in range(out.size):
        d0, d1, d2 = a0[x] - b0[x], a1[x] - b1[x], a2[x] - b2[x]
        out[x] = min((d0 * d0 + d1 * d1 + d2 * d2) * third, limit)


@njit(nogil=True, cache=True, fastmath=FLAGS)
def _add(term, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):
        out[x] += term[x]


@njit(nogil=True, cache=True, fastmath=FLAGS)
def _copy(values, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):  # a slice assigned to a slice takes seconds to compile
        out[x] = values[x]


@njit(nogil=True, cache=True, fastmath=FLAGS)
def _level(total, before, after, rows, index, last):  # type: ignore[no-untyped-def]
    """Index into the table of `falloff` of the root mean square of a window's sum."""
    one, half, steps = np.float32(1), np.float32(0.5), np.float32(LEVEL_STEPS)
    for x in range(total.size):
        mean = total[x] / ((before[x] + after[x] + one) * rows)
        index[x] = np.int32(min(np.sqrt(mean) * steps + half, last))


@njit(nogil=True, cache=True, fastmath=FLAGS)
def _look_up(index, table, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):
        out[x] = table[np.uint32(index[x])]


@njit(nogil=True, cache=True, fastmath=FLAGS)
def _pair_rows(left, right, i, j, first, origin, radius, fineness, limit, table, y0, p, out):  # type: ignore[no-untyped-def]
    """Similarities of pair p = (i, j) for the rows y0, y0 + 1, ... of `out` (rows, pairs, planes, columns).

    Squared differences of a row are computed once and kept while windows need them. Taps that
    leave a frame of either view are left out of the mean.
    """
    height, samples = left.shape[1], left.shape[2]
    planes, side = out.shape[2], 2 * radius + 1
    reach = radius * fineness
    ring = np.empty((side, planes, samples), np.float32)
    column = np.zeros(samples + 2 * reach, np.float32)
    total = np.empty(samples, np.float32)
    index = np.empty(samples, np.int32)
    before = np.empty(samples, np.float32)
    for x in range(samples):
        before[x] = min(radius, x // fineness)
    after = before[::-1].copy()
    last = np.float32(table.size - 1)
    ready = max(0, y0 - radius)
    for y in range(y0, y0 + out.shape[0]):
        top, bottom = max(0, y - radius), min(height, y + radius + 1)
        for k in range(planes):
            # columns of the two frusta in this plane; width is what they share
            start_i, start_j = i * (first + k) - origin, j * (first + k) - origin
            low = max(start_i, start_j)
            width = min(start_i, start_j) + samples - low
            if width <= 0:
                continue
            ui, uj = low - start_i, low - start_j
            for row in range(ready, bottom):
                _square_difference(
                    left[0, row, ui : ui + width],
                    left[1, row, ui : ui + width],
                    left[2, row, ui : ui + width],
                    right[0, row, uj : uj + width],
                    right[1, row, uj : uj + width],
                    right[2, row, uj : uj + width],
                    limit,
                    ring[row % side, k, :width],
                )
            _copy(ring[top % side, k, :width], column[reach : reach + width])
            for row in range(top + 1, bottom):
                _add(ring[row % side, k, :width], column[reach : reach + width])
            column[reach + width : reach + width + reach] = 0
            _copy(column[:width], total[:width])
            for tap in range(1, side):
                _add(column[tap * fineness : tap * fineness + width], total[:width])
            rows = np.float32(bottom - top)
            _level(total[:width], before[:width], after[samples - width :], rows, index[:width], last)
            _look_up(index[:width], table, out[y - y0, p, k, low : low + width])
        ready = bottom


@frozen
class Matching:
    """Which views are compared, where and how: what materiality and its control have in common.

    Parameters
    ----------
    views
        Use at most this many of the scene's views, as widely spaced as they fit; 0 for all.
    fineness
        q, planes per pixel of view step; 0 = planes at most one pixel of the field's pair apart.
    pairs
        The set r of pairs (i, j): ``consecutive`` or ``all`` views.
    similarity
        ``ssd``: rho = exp(-MSD / sigma^2); ``rms``: rho = exp(-sqrt(MSD) / sigma), with MSD the mean
        square difference of the two windows per pixel and colour.
    window
        Side of the square window in pixels, odd.
    sigma
        Grey levels.
    truncation
        Differences of a pixel (root mean square over its colours) count at most this many grey
        levels; 0 = no limit.
    colour
        Compare colours, or only luma.
    """

    views: int = field(default=5, validator=all_or_several)
    fineness: int = field(default=0, validator=validators.ge(0))
    pairs: PairSet = field(default="consecutive", validator=validators.in_(get_args(PairSet)))
    similarity: Form = field(default="rms", validator=validators.in_(get_args(Form)))
    window: int = field(default=3, validator=odd)
    sigma: float = field(default=9.0, validator=validators.gt(0))
    truncation: float = field(default=20.0, validator=validators.ge(0))
    colour: bool = True


@frozen(eq=False)
class Matcher:
    """The similarities of one scene: computed for any rows, or all at once.

    Parameters
    ----------
    scene
        The chosen views.
    indices
        Which views of the given scene they are; evenly spaced.
    space
        Target points of the chosen views.
    pairs
        (pairs, 2) pairs of chosen views, left one first.
    rows
        (views, 3, H, samples) float32 rows sampled at the space's fineness.
    settings
        How windows are compared.
    """

    scene: Scene
    indices: tuple[int, ...]
    space: DisparitySpace
    pairs: NDArray[np.int64]
    rows: NDArray[np.float32]
    settings: Matching

    @classmethod
    def of(cls, scene: Scene, settings: Matching) -> "Matcher":
        """Choose views and planes, and sample the rows."""
        indices = scene.widest(settings.views or scene.n)
        chosen = scene.choose(indices)
        space = search_space(chosen, settings.fineness)
        rows = fine_rows(chosen.views, space.fineness)
        if not settings.colour:
            luma = np.tensordot(rows, np.array(LUMA, np.float32), ([1], [0]))
            rows = np.ascontiguousarray(np.broadcast_to(luma[:, None], rows.shape))
        return cls(chosen, indices, space, pairs(chosen.n, settings.pairs), rows, settings)

    @property
    def step(self) -> int:
        """View steps of the given scene in one view step of the chosen views."""
        return self.indices[1] - self.indices[0]

    @property
    def comparisons(self) -> int:
        """How many pairs of windows are compared: target points in both frusta, summed over pairs."""
        space = self.space
        planes = np.arange(space.first, space.last + 1)
        shared = [np.maximum(0, space.samples - abs(j - i) * np.abs(planes)).sum() for i, j in self.pairs]
        return int(space.rows * sum(shared))

    def disparity(self, planes: NDArray[np.float32]) -> NDArray[np.float32]:
        """Fractional plane indices of the space as disparities in pixels per view step of the given scene."""
        scale = np.float32(1 / (self.space.fineness * self.step))
        return np.asarray((planes + np.float32(self.space.first)) * scale, np.float32)

    def block(self, first: int, end: int) -> NDArray[np.uint8]:
        """(end - first, pairs, planes, columns) similarities of some rows in 255ths.

        One byte per point and pair, rounded to nearest; 0 where the point leaves either frustum.
        """
        space, settings = self.space, self.settings
        out = np.zeros((end - first, len(self.pairs), space.planes, space.columns), np.uint8)
        self._fill(first, out, falloff(settings.similarity, settings.sigma))
        return out

    def all(self, threads: int = 1) -> NDArray[np.uint8]:
        """(rows, pairs, planes, columns) similarities of all rows in 255ths, as `block` gives them."""
        space, settings = self.space, self.settings
        out = np.zeros((space.rows, len(self.pairs), space.planes, space.columns), np.uint8)
        table = falloff(settings.similarity, settings.sigma)
        over_rows(lambda first, end: self._fill(first, out[first:end], table), space.rows, threads)
        return out

    def _fill(self, first: int, out: NDArray[np.uint8], table: NDArray[np.uint8]) -> None:
        space, settings = self.space, self.settings
        limit = np.float32(settings.truncation**2 if settings.truncation else np.inf)
        for p, (i, j) in enumerate(self.pairs):
            _pair_rows(
                self.rows[i],
                self.rows[j],
                i,
                j,
                space.first,
                space.origin,
                settings.window // 2,
                space.fineness,
                limit,
                table,
                first,
                p,
                out,
            )
