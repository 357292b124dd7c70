"""Similarities rho_ij of windows in pairs of views, over all target points (SPEC 1)."""

from itertools import combinations, pairwise
from typing import Literal, get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms.features import census, gradient, luma
from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, odd
from matbench.algorithms.sampling import fine_rows, search_space
from matbench.scene import Scene
from matbench.space import DisparitySpace

PairSet = Literal["all", "consecutive", "reference"]
Form = Literal["ssd", "rms", "mixed"]
FULL = 255  # a stored similarity of 1: similarities are kept in one byte
LEVEL_STEPS = 64  # steps of the table per grey level
COLOUR, SLOPE, CENSUS = 0.35, 0.25, 0.40  # weights of the three costs of ``mixed``
COLOUR_SPAN, SLOPE_SPAN, CENSUS_SPAN = 20.0, 10.0, 20.0  # differences that cost the whole weight


# (views, phases, 3, H, samples) colours, (views, phases, H, samples) gradients and census
Features = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint64]]


def _by_phase(values: NDArray[np.generic], fineness: int) -> NDArray[np.generic]:
    """(views, ..., samples) as (views, phases, ..., width); 0 beyond the last sample."""
    width = (values.shape[-1] - 1) // fineness + 1
    out = np.zeros((values.shape[0], fineness, *values.shape[1:-1], width), values.dtype)
    for phase in range(fineness):
        part = values[..., phase::fineness]
        out[:, phase, ..., : part.shape[-1]] = part
    return out


def pairs(views: int, which: PairSet, ref: int = 0) -> NDArray[np.int64]:
    """(pairs, 2) the set r of SPEC 1, left view first.

    ``all`` pairs of views, the ``consecutive`` ones, or those that the view `ref` is part of
    (``reference``).
    """
    chosen = pairwise(range(views)) if which == "consecutive" else combinations(range(views), 2)
    return np.array([pair for pair in chosen if which != "reference" or ref in pair], np.int64)


def falloff(form: Form, sigma: float) -> NDArray[np.uint8]:
    """Similarity in 255ths for root mean square differences of 0, 1/64, 2/64, ... grey levels.

    ``ssd`` is exp(-MSD / sigma^2), ``rms`` is exp(-RMS / sigma). The table ends at its first zero.
    For ``mixed`` it is the identity, as that is computed without a table.
    """
    if form == "mixed":
        return np.arange(FULL + 1, dtype=np.uint8)
    levels = np.arange(LEVEL_STEPS * 512) / (LEVEL_STEPS * sigma)
    table: NDArray[np.uint8] = np.rint(FULL * np.exp(-(levels**2) if form == "ssd" else -levels)).astype(np.uint8)
    return table[: int(np.argmin(table)) + 1].copy()


@helper
def _square_difference(a0, a1, a2, b0, b1, b2, limit, out):  # type: ignore[no-untyped-def]
    """out = min(mean over colours of (a - b)^2, limit), for rows of three colours."""
    third = np.float32(1 / 3)
    for x in range(out.size):
        d0, d1, d2 = a0[x] - b0[x], a1[x] - b1[x], a2[x] - b2[x]
        out[x] = min((d0 * d0 + d1 * d1 + d2 * d2) * third, limit)


@helper
def _mixed_difference(a0, a1, a2, b0, b1, b2, slope_a, slope_b, bits_a, bits_b, limit, out):  # type: ignore[no-untyped-def]
    """out = the cost of ``mixed`` at every pixel, between 0 and 1 unless `limit` allows more."""
    colour, slope = np.float32(COLOUR / COLOUR_SPAN / 3), np.float32(SLOPE / SLOPE_SPAN)
    order = np.float32(CENSUS / CENSUS_SPAN)
    steepest, farthest = np.float32(SLOPE_SPAN), np.float32(CENSUS_SPAN)
    # how many bits are set: sums of neighbouring bits, pairs, nibbles and bytes
    m1, m2, m4 = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333), np.uint64(0x0F0F0F0F0F0F0F0F)
    one, two, four, ones, top = np.uint64(1), np.uint64(2), np.uint64(4), np.uint64(0x0101010101010101), np.uint64(56)
    for x in range(out.size):
        bits = bits_a[x] ^ bits_b[x]
        bits -= (bits >> one) & m1
        bits = (bits & m2) + ((bits >> two) & m2)
        bits = (((bits + (bits >> four)) & m4) * ones) >> top
        difference = abs(a0[x] - b0[x]) + abs(a1[x] - b1[x]) + abs(a2[x] - b2[x])
        out[x] = (
            colour * min(difference, limit)
            + slope * min(abs(slope_a[x] - slope_b[x]), steepest)
            + order * min(np.float32(np.int32(bits)), farthest)
        )


@helper
def _add(term, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):
        out[x] += term[x]


@helper
def _copy(values, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):  # a slice assigned to a slice takes seconds to compile
        out[x] = values[x]


@helper
def _level(total, before, after, rows, index, last):  # type: ignore[no-untyped-def]
    """Index into the table of `falloff` of the root mean square of a window's sum."""
    one, half, steps = np.float32(1), np.float32(0.5), np.float32(LEVEL_STEPS)
    for x in range(total.size):
        mean = total[x] / ((before[x] + after[x] + one) * rows)
        index[x] = np.int32(min(np.sqrt(mean) * steps + half, last))


@helper
def _complement(total, before, after, rows, index):  # type: ignore[no-untyped-def]
    """1 - the mean of a window's sum, in 255ths."""
    zero, one, half, full = np.float32(0), np.float32(1), np.float32(0.5), np.float32(FULL)
    for x in range(total.size):
        mean = total[x] / ((before[x] + after[x] + one) * rows)
        index[x] = np.int32(max(full - full * mean, zero) + half)


@helper
def _look_up(index, table, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):
        out[x] = table[np.uint32(index[x])]


@kernel
def _pair_rows(  # type: ignore[no-untyped-def]
    left, right, left_slope, right_slope, left_bits, right_bits, mixed,
    spans, radius, fineness, limit, table, y0, p, out,
):  # fmt: skip
    """Similarities of pair p for the rows y0, y0 + 1, ... of `out` (rows, pairs, planes, columns).

    Colours are (phases, 3, H, samples), gradients and census (phases, H, samples); `spans` says
    where a plane's points lie in them and in `out`. Differences of a row are computed once and kept
    while windows need them. Taps that leave a frame of either view are left out of the mean.
    """
    height, samples = left.shape[2], left.shape[3]
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
            low, width = spans[k, 0], spans[k, 1]
            fi, ui, fj, uj = spans[k, 2], spans[k, 3], spans[k, 4], spans[k, 5]
            if width <= 0:
                continue
            for row in range(ready, bottom):
                a0, b0 = left[fi, 0, row, ui : ui + width], right[fj, 0, row, uj : uj + width]
                a1, b1 = left[fi, 1, row, ui : ui + width], right[fj, 1, row, uj : uj + width]
                a2, b2 = left[fi, 2, row, ui : ui + width], right[fj, 2, row, uj : uj + width]
                cost = ring[row % side, k, :width]
                if mixed:
                    slope_a, slope_b = left_slope[fi, row, ui : ui + width], right_slope[fj, row, uj : uj + width]
                    bits_a, bits_b = left_bits[fi, row, ui : ui + width], right_bits[fj, row, uj : uj + width]
                    _mixed_difference(a0, a1, a2, b0, b1, b2, slope_a, slope_b, bits_a, bits_b, limit, cost)
                else:
                    _square_difference(a0, a1, a2, b0, b1, b2, limit, cost)
            _copy(ring[top % side, k, :width], column[reach : reach + width])
            for row in range(top + 1, bottom):
                _add(ring[row % side, k, :width], column[reach : reach + width])
            column[reach + width : reach + width + reach] = 0
            _copy(column[:width], total[:width])
            for tap in range(1, side):
                _add(column[tap * fineness : tap * fineness + width], total[:width])
            rows = np.float32(bottom - top)
            if mixed:
                _complement(total[:width], before[:width], after[samples - width :], rows, index[:width])
            else:
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
        The set r of pairs (i, j): ``consecutive`` views, ``all``, or the ``reference`` with every
        other view.
    similarity
        ``ssd``: rho = exp(-MSD / sigma^2); ``rms``: rho = exp(-sqrt(MSD) / sigma), with MSD the mean
        square difference of the two windows per pixel and colour; ``mixed``: rho = 1 - the mean
        over the two windows of 0.35 |dI| / 20 + 0.25 min(|dg|, 10) / 10 + 0.40 min(h, 20) / 20, with
        |dI| the mean absolute difference over the colours, dg that of the horizontal gradients of
        the luma, and h how many bits of the pixels' 7x7 census differ.
    window
        Side of the square window in pixels, odd.
    sigma
        Grey levels, of ``ssd`` and ``rms``.
    truncation
        Differences of a pixel's colours (their root mean square; in ``mixed`` their mean) count at
        most this many grey levels; 0 = no limit.
    colour
        Compare colours, or only luma.
    """

    views: int = field(default=5, validator=all_or_several)
    fineness: int = field(default=0, validator=validators.ge(0))
    pairs: PairSet = field(default="reference", validator=validators.in_(get_args(PairSet)))
    similarity: Form = field(default="mixed", validator=validators.in_(get_args(Form)))
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
    slopes, bits
        (views, H, samples) their horizontal gradients and census; no rows where nothing reads them.
    settings
        How windows are compared.
    """

    scene: Scene
    indices: tuple[int, ...]
    space: DisparitySpace
    pairs: NDArray[np.int64]
    rows: NDArray[np.float32]
    slopes: NDArray[np.float32]
    bits: NDArray[np.uint64]
    settings: Matching

    @classmethod
    def of(cls, scene: Scene, settings: Matching) -> "Matcher":
        """Choose views and planes, and sample the rows."""
        indices = scene.widest(settings.views or scene.n)
        chosen = scene.choose(indices)
        space = search_space(chosen, settings.fineness)
        rows = fine_rows(chosen.views, space.fineness)
        if not settings.colour:
            rows = np.ascontiguousarray(np.broadcast_to(luma(rows)[:, None], rows.shape))
        grey = luma(rows if settings.similarity == "mixed" else rows[:, :, :0])
        slopes, bits = gradient(grey, space.fineness), census(grey, space.fineness)
        return cls(chosen, indices, space, pairs(chosen.n, settings.pairs, chosen.ref), rows, slopes, bits, settings)

    @property
    def step(self) -> int:
        """View steps of the given scene in one view step of the chosen views."""
        return self.indices[1] - self.indices[0]

    @property
    def comparisons(self) -> int:
        """How many pairs of windows `all` compares: target points in both frusta, summed over pairs."""
        return self.space.rows * sum(int(self.spans(i, j)[:, 1].sum()) for i, j in self.pairs)

    @property
    def ray_comparisons(self) -> int:
        """The same for `rays` of all rows."""
        return self.space.rows * sum(int(self.ray_spans(i, j)[:, 1].sum()) for i, j in self.pairs)

    def spans(self, i: int, j: int) -> NDArray[np.int64]:
        """(planes, 6) where the points of each plane lie that both views see.

        First column of a volume and number of columns, then phase and column where they start in
        view i, then in view j; the phase is 0, as all samples are counted.
        """
        space = self.space
        plane = np.arange(space.first, space.last + 1)
        starts = i * plane - space.origin, j * plane - space.origin
        low = np.maximum(*starts)
        width = np.maximum(0, np.minimum(*starts) + space.samples - low)
        none = np.zeros_like(low)
        return np.stack([low, width, none, low - starts[0], none, low - starts[1]], axis=1)

    def ray_spans(self, i: int, j: int) -> NDArray[np.int64]:
        """The same for points on the pixel rays of the reference view: columns are its pixels.

        Samples of the views are counted in whole pixels from their phase on.
        """
        space, q = self.space, self.space.fineness
        plane = np.arange(space.first, space.last + 1)
        (whole_i, phase_i), (whole_j, phase_j) = (np.divmod((self.scene.ref - view) * plane, q) for view in (i, j))
        low = np.maximum(0, np.maximum(-whole_i, -whole_j))
        end = space.width - np.maximum(0, np.maximum(whole_i + (phase_i > 0), whole_j + (phase_j > 0)))
        return np.stack([low, np.maximum(0, end - low), phase_i, low + whole_i, phase_j, low + whole_j], axis=1)

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

    def rays(self, phases: Features, first: int, end: int) -> NDArray[np.uint8]:
        """(end - first, pairs, planes, width) what `block` holds at the whole pixels of the reference view.

        Windows end where the reference image does, too. `phases`, from the method of that name, are
        computed once, as they serve every view and all rows.
        """
        space, settings = self.space, self.settings
        out = np.zeros((end - first, len(self.pairs), space.planes, space.width), np.uint8)
        self._compare(phases, first, out, falloff(settings.similarity, settings.sigma), on_rays=True)
        return out

    def all(self, threads: int = 1) -> NDArray[np.uint8]:
        """(rows, pairs, planes, columns) similarities of all rows in 255ths, as `block` gives them."""
        space, settings = self.space, self.settings
        out = np.zeros((space.rows, len(self.pairs), space.planes, space.columns), np.uint8)
        table = falloff(settings.similarity, settings.sigma)
        over_rows(lambda first, end: self._fill(first, out[first:end], table), space.rows, threads)
        return out

    def phases(self) -> Features:
        """The rows sorted by their phase within a pixel, so that every q-th sample is read contiguously."""
        return tuple(_by_phase(part, self.space.fineness) for part in (self.rows, self.slopes, self.bits))  # type: ignore[return-value]

    def _fill(self, first: int, out: NDArray[np.uint8], table: NDArray[np.uint8]) -> None:
        whole = self.rows[:, None], self.slopes[:, None], self.bits[:, None]
        self._compare(whole, first, out, table, on_rays=False)

    def _compare(
        self, features: Features, first: int, out: NDArray[np.uint8], table: NDArray[np.uint8], on_rays: bool
    ) -> None:
        settings, (rows, slopes, bits) = self.settings, features
        mixed = settings.similarity == "mixed"
        limit = np.float32((3 * settings.truncation if mixed else settings.truncation**2) or np.inf)
        for p, (i, j) in enumerate(self.pairs):
            _pair_rows(
                rows[i],
                rows[j],
                slopes[i],
                slopes[j],
                bits[i],
                bits[j],
                mixed,
                self.ray_spans(i, j) if on_rays else self.spans(i, j),
                settings.window // 2,
                1 if on_rays else self.space.fineness,
                limit,
                table,
                first,
                p,
                out,
            )
