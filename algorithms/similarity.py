"""Similarities rho_ij of windows in pairs of views, at all target points (docs/concepts/methods.md)."""

from collections.abc import Mapping
from functools import cached_property
from itertools import combinations, pairwise
from typing import Any, Literal, get_args

import numpy as np
from attrs import evolve, field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms import mccnn
from matbench.algorithms.features import SHIFTS, census, gradient, luma, same_surface, strengthened, whole
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, odd, planes_a_pixel, unread
from matbench.algorithms.pixels import PIXELS, compare_pixels, most_costly
from matbench.algorithms.room import Room
from matbench.algorithms.sampling import by_phase, fine_rows, search_space
from matbench.algorithms.windows import (
    CENSUS,
    EXPONENTIAL,
    LEARNED,
    LINEAR,
    MIXED,
    ROOT,
    SQUARES,
    Criterion,
    Features,
    pair_rows,
)
from matbench.algorithms.windows import FULL as FULL
from matbench.scene import Scene
from matbench.space import DisparitySpace

PairSet = Literal["all", "consecutive", "reference"]
Form = Literal["ssd", "rms", "linear", "census", "mixed", "mccnn"]


def pairs(views: int, which: PairSet, ref: int = 0) -> NDArray[np.int64]:
    """(pairs, 2) the set r of equation 6, left view first.

    ``all`` pairs of views, the ``consecutive`` ones, or those that the view `ref` is part of
    (``reference``).
    """
    chosen = pairwise(range(views)) if which == "consecutive" else combinations(range(views), 2)
    return np.array([pair for pair in chosen if which != "reference" or ref in pair], np.int64)


@frozen
class Matching:
    """Matching costs: which views are compared, where and how. A group of parameters.

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
        With MSD the mean square difference of the two windows per pixel and colour, ``ssd``:
        rho = exp(-MSD / sigma^2); ``rms``: rho = exp(-sqrt(MSD) / sigma); ``linear``:
        rho = 1 - MSD / M, M being the largest possible, 255^2 or truncation^2. With h how many bits
        of the pixels' 7x7 census differ, ``census``: rho = 1 - the mean over the two windows of
        min(h, 20) / 20. ``mixed``: rho = 1 - that of 0.35 |dI| / 20 + 0.25 min(|dg|, 10) / 10
        + 0.40 min(h, 20) / 20, |dI| being the mean absolute difference over the colours and dg that
        of the horizontal gradients of the luma (see `texture`). ``mccnn``: rho = f g, or 0 where that is less, with
        f and g descriptors of 11x11 pixels by a trained network (`algorithms.mccnn`); it takes
        ``pip install 'matbench-stereo[mccnn]'``.
    window
        Side of the square window in pixels, odd.
    sigma
        Grey levels, of ``ssd`` and ``rms``.
    truncation
        Differences of a pixel's colours (their root mean square; in ``mixed`` their mean) count at
        most this many grey levels; 0 = no limit.
    texture
        Grey levels. The gradients of ``mixed`` are multiplied by texture / (s + 0.2), where that is more than 1, with s
        their root mean square in the 5x5 pixels around: so weak texture says as much as strong. 0 takes them as
        they are.
    colour
        Compare colours, or only luma: 0.299 R + 0.587 G + 0.114 B.
    alike
        Grey levels. A census compares the eight next pixels, and all others whose colours differ from the
        middle pixel by at most this much in both views (h is scaled up to 48 bits). Pixels across a depth
        jump say nothing about the middle one. 0 compares all 48.
    """

    views: int = field(default=9, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)
    pairs: PairSet = field(default="reference", validator=validators.in_(get_args(PairSet)))
    similarity: Form = field(default="mixed", validator=[validators.in_(get_args(Form)), mccnn.installed])
    window: int = field(default=3, validator=odd)
    sigma: float = field(default=9.0, validator=validators.gt(0))
    truncation: float = field(default=20.0, validator=validators.ge(0))
    texture: float = field(default=6.0, validator=[validators.ge(0), validators.le(255)])
    colour: bool = True
    alike: float = field(default=10.0, validator=validators.ge(0))

    @property
    def silent(self) -> Mapping[str, str]:
        """Parameter -> what it needs to have an effect, for those that this similarity does not read."""
        form = self.similarity
        takes = {
            "sigma": (form in ("ssd", "rms"), "similarity=ssd or rms"),
            "truncation": (form not in ("census", "mccnn"), "another similarity than census and mccnn"),
            "texture": (form == "mixed", "similarity=mixed"),
            "alike": (form in ("census", "mixed"), "similarity=census or mixed"),
            "colour": (
                form != "mccnn" and (form != "census" or self.alike > 0),
                "another similarity than mccnn and census, or census and alike above 0",
            ),
        }
        return unread(takes)


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
        (views, channels, H, samples) float32 rows sampled at the space's fineness: colours, or luma.
    slopes
        (views, H, samples) horizontal gradients of the luma, `strengthened`; H is 0 if the similarity does not use
        them.
    bits, masks
        (views, words, H, samples) census of the luma, and which of its pixels are likely on the same surface
        as the middle one; H is 0 if the similarity does not use them.
    descriptors
        (views, H, samples, 64) int8, as `mccnn.descriptors` gives them; H is 0 if the similarity does not use them.
    settings
        How windows are compared.
    ready
        What `phases` gives, if nothing else is kept (`on_rays`).
    """

    scene: Scene
    indices: tuple[int, ...]
    space: DisparitySpace
    pairs: NDArray[np.int64]
    rows: NDArray[np.float32]
    slopes: NDArray[np.float32]
    bits: NDArray[np.uint8]
    masks: NDArray[np.uint8]
    descriptors: NDArray[np.int8]
    settings: Matching
    ready: Features | None = None

    @classmethod
    def of(cls, scene: Scene, settings: Matching, threads: int = 1) -> "Matcher":
        """Choose views and planes, and sample the rows."""
        indices = scene.widest(settings.views or scene.n)
        chosen = scene.choose(indices)
        space = search_space(chosen, settings.fineness)
        rows = fine_rows(chosen.views, space.fineness, threads)
        grey, form = luma(rows, threads), settings.similarity
        slopes = gradient(grey if form == "mixed" else grey[:, :0], space.fineness, threads)
        slopes = strengthened(slopes, space.fineness, settings.texture, threads)
        bits = census(grey if form in ("census", "mixed") else grey[:, :0], space.fineness, threads)
        if not settings.colour:
            rows = grey[:, None]
        is_masked = bits.size and settings.alike
        masks = same_surface(rows if is_masked else rows[:, :, :0], space.fineness, settings.alike, threads)
        described = (
            mccnn.descriptors(grey, space.fineness, threads)
            if form == "mccnn"
            else np.zeros((chosen.n, 0, 0, 0), np.int8)
        )
        chosen_pairs = pairs(chosen.n, settings.pairs, chosen.ref)
        return cls(chosen, indices, space, chosen_pairs, rows, slopes, bits, masks, described, settings)

    def with_reference(self, view: int) -> "Matcher":
        """The same views with another reference view; with ``reference`` pairs, the pairs change with it."""
        scene = evolve(self.scene, ref=view, regions={})
        return evolve(self, scene=scene, pairs=pairs(self.space.views, self.settings.pairs, view))

    def on_rays(self, threads: int = 1) -> "Matcher":
        """The same for `rays` alone: features are sorted once, and others are not kept."""
        ready, none = self.phases(threads), np.zeros((self.space.views, 0, 0, 0), np.uint8)
        rows = np.zeros((self.space.views, self.rows.shape[1], 0, 0), np.float32)
        return evolve(self, ready=ready, rows=rows, slopes=rows[:, 0], bits=none, masks=none)

    @property
    def step(self) -> int:
        """View steps of the given scene in one view step of the chosen views."""
        return self.indices[1] - self.indices[0]

    @property
    def comparisons(self) -> int:
        """How many pairs of windows `all` compares: target points in both frusta, summed over the pairs of views."""
        return self.space.rows * sum(int(self.spans(i, j)[:, 1].sum()) for i, j in self.pairs)

    @property
    def ray_comparisons(self) -> int:
        """The same for `rays` of all rows."""
        return self.space.rows * sum(int(self.ray_spans(i, j)[:, 1].sum()) for i, j in self.pairs)

    @property
    def ray_bytes(self) -> int:
        """Bytes of a float32 volume over the pixel rays of one view."""
        return 4 * self.space.rows * self.space.width * self.space.planes

    def spans(self, i: int, j: int) -> NDArray[np.int64]:
        """(planes, 6) for each plane, the place in a volume of the points that are in the frusta of both views.

        The six numbers are: the first column, the number of columns, phase and sample of the first column in
        view i, and the same in view j. The phase is always 0 here: samples are not sorted by phase.
        """
        space = self.space
        plane = np.arange(space.first, space.last + 1)
        starts = i * plane - space.origin, j * plane - space.origin
        low = np.maximum(*starts)
        width = np.maximum(0, np.minimum(*starts) + space.samples - low)
        none = np.zeros_like(low)
        return np.stack([low, width, none, low - starts[0], none, low - starts[1]], axis=1)

    def ray_spans(self, i: int, j: int) -> NDArray[np.int64]:
        """The same for points on the pixel rays of the reference view; columns are its pixels.

        Samples are sorted by phase (`phases`), and counted among those of one phase.
        """
        space, q = self.space, self.space.fineness
        plane = np.arange(space.first, space.last + 1)
        (whole_i, phase_i), (whole_j, phase_j) = (np.divmod((self.scene.ref - view) * plane, q) for view in (i, j))
        low = np.maximum(0, np.maximum(-whole_i, -whole_j))
        end = space.width - np.maximum(0, np.maximum(whole_i + (phase_i > 0), whole_j + (phase_j > 0)))
        return np.stack([low, np.maximum(0, end - low), phase_i, low + whole_i, phase_j, low + whole_j], axis=1)

    # kept, as every few rows ask for them: anew they would take a tenth of the time
    @cached_property
    def _all_spans(self) -> list[NDArray[np.int64]]:
        return [self.spans(i, j) for i, j in self.pairs]

    @cached_property
    def _all_ray_spans(self) -> list[NDArray[np.int64]]:
        return [self.ray_spans(i, j) for i, j in self.pairs]

    @cached_property
    def _stacked_ray_spans(self) -> NDArray[np.int64]:
        return np.stack(self._all_ray_spans)

    @cached_property
    def _compared(self) -> tuple[NDArray[np.generic], ...]:
        """What views are compared by: rows, slopes, bits and masks as `Features` have them."""
        rows = whole(self.rows, SHIFTS[0]) if self.settings.similarity == "mixed" else self.rows
        return rows, whole(self.slopes, SHIFTS[1]), self.bits, self.masks

    def disparity(self, planes: NDArray[np.float32]) -> NDArray[np.float32]:
        """Fractional plane indices of the space as disparities in pixels per view step of the given scene."""
        scale = np.float32(1 / (self.space.fineness * self.step))
        return np.asarray((planes + np.float32(self.space.first)) * scale, np.float32)

    def block(self, first: int, end: int) -> NDArray[np.uint8]:
        """(end - first, pairs, planes, columns) similarities of some rows in 255ths.

        One byte per point and pair, rounded to nearest; 0 where the point leaves either frustum.
        """
        space = self.space
        out = np.zeros((end - first, len(self.pairs), space.planes, space.columns), np.uint8)
        self._fill(first, out)
        return out

    def rays(
        self, phases: Features, first: int, end: int, window: int | None = None, room: Room | None = None
    ) -> NDArray[np.uint8]:
        """(end - first, pairs, planes, width) what `block` holds at the whole pixels of the reference view.

        Here windows end where the reference image does, too.

        Parameters
        ----------
        phases
            From the method of that name: they serve every reference view and all rows.
        window
            Side of the window in pixels, if it is not that of the settings.
        room
            Where the array is taken from: the next from there overwrites it.
        """
        space = self.space
        shape = end - first, len(self.pairs), space.planes, space.width
        out = (room or Room()).empty("rho", shape, np.uint8)
        if self.by_pixels(window):
            compare_pixels(phases, self.pairs, *self.pixel_criterion(phases), self._stacked_ray_spans, first, out)
        else:
            out.fill(0)
            self._compare(phases, first, out, on_rays=True, window=window)
        return out

    def by_pixels(self, window: int | None = None) -> bool:
        """Are single pixels compared, with a window of that side or that of the settings, in whole numbers?"""
        return self.settings.similarity == "mixed" and (self.settings.window if window is None else window) == 1

    def pixel_criterion(self, phases: Features) -> tuple[tuple[int, ...], tuple[int, ...], np.uint16]:
        """What `compare_pixels` takes besides the features: is the census masked, the channels, and the limit."""
        channels = phases.rows.shape[2]
        return (0,) * bool(phases.masks.size), (0,) * channels, most_costly(channels, self.settings.truncation)

    def all(self, threads: int = 1) -> NDArray[np.uint8]:
        """(rows, pairs, planes, columns) similarities of all rows in 255ths, as `block` gives them."""
        space = self.space
        out = np.zeros((space.rows, len(self.pairs), space.planes, space.columns), np.uint8)
        over_rows(lambda first, end: self._fill(first, out[first:end]), space.rows, threads)
        return out

    def phases(self, threads: int = 1) -> Features:
        """Rows and their features sorted by phase within a pixel, so that every q-th sample is read contiguously."""
        if self.ready is not None:
            return self.ready
        mixed = self.settings.similarity == "mixed"

        def sort(values: NDArray[Any], shift: float | None = None) -> NDArray[Any]:
            return by_phase(values, self.space.fineness, PIXELS if mixed else 0, threads, shift)

        rows, slopes = sort(self.rows, SHIFTS[0] if mixed else None), sort(self.slopes, SHIFTS[1])
        return Features(rows, slopes, sort(self.bits), sort(self.masks), self.descriptors)

    def _fill(self, first: int, out: NDArray[np.uint8]) -> None:
        unsorted = Features(*(part[:, None] for part in self._compared), self.descriptors)  # type: ignore[call-arg, arg-type]
        self._compare(unsorted, first, out, on_rays=False)

    def _compare(
        self, features: Features, first: int, out: NDArray[np.uint8], on_rays: bool, window: int | None = None
    ) -> None:
        settings, limit = self.settings, self.settings.truncation
        channels = (0,) * features.rows.shape[2]
        side = settings.window if window is None else window
        measure, shape, rate = {
            "ssd": (SQUARES, EXPONENTIAL, settings.sigma**-2),
            "rms": (SQUARES, ROOT, 1 / settings.sigma),
            "linear": (SQUARES, LINEAR, (limit or 255.0) ** -2),
            "census": (CENSUS, LINEAR, 1.0),
            "mixed": (MIXED, LINEAR, 1.0),
            "mccnn": (LEARNED, LINEAR, 1.0),
        }[settings.similarity]
        limit = len(channels) * limit if measure == MIXED else limit**2
        criterion = Criterion(
            measure,
            shape,
            rate,
            np.float32(limit or np.inf),
            (0,) * bool(features.masks.size),
            channels,
            (0,) * side,
            self.space.fineness if on_rays else 1,
        )
        spans, fineness = (self._all_ray_spans, 1) if on_rays else (self._all_spans, self.space.fineness)
        for p, (i, j) in enumerate(self.pairs):
            pair_rows(
                features.of(i),
                features.of(j),
                criterion,
                spans[p],
                fineness,
                first,
                p,
                out,
            )
