"""A scene: rectified views along a line, and what is known about them."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from hashlib import sha256
from itertools import pairwise
from math import isfinite
from types import MappingProxyType
from typing import Any

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from matbench.errors import UserError, refuse_hidden

SAME_PLACE = 1e-6
"""View steps: positions that differ by no more than this are one."""

_ROUNDING = 1e-4  # px of the pair: float32 rounding does not decide what is in the range


class SceneError(UserError):
    """A scene that contradicts itself, or a choice of views that it cannot give."""


class NotInScene(SceneError):
    """A number of views, or a baseline, that a scene does not have. A pattern then leaves the scene out."""


@frozen
class Range:
    """Least and largest disparity, both included, in pixels per view step; may be negative.

    Raises
    ------
    SceneError
        If a bound is not finite or the range is empty.
    """

    least: float
    largest: float

    def __attrs_post_init__(self) -> None:
        if not (isfinite(self.least) and isfinite(self.largest)):
            raise SceneError(f"disparity range {self} must have finite bounds")
        if self.largest < self.least:
            raise SceneError(f"disparity range {self} is empty: the first must not exceed the second")

    def __str__(self) -> str:
        return f"{self.least:g}..{self.largest:g}"

    def scaled(self, factor: float) -> "Range":
        return Range(self.least * factor, self.largest * factor)


def _uneven(positions: Sequence[float]) -> tuple[float, ...]:
    """The positions, or none if they are the even ones."""
    given = tuple(map(float, positions))
    return () if given == tuple(range(len(given))) else given


def _frozen_array(array: NDArray[Any]) -> NDArray[Any]:
    """A read-only, contiguous array; copied only where somebody else could still write to it."""
    own = np.ascontiguousarray(array)
    if own.flags.writeable:
        own = own.copy() if own is array else own
        own.setflags(write=False)
    return own


def _frozen_arrays(arrays: Mapping[Any, NDArray[Any]]) -> Mapping[Any, NDArray[Any]]:
    return MappingProxyType({key: _frozen_array(array) for key, array in arrays.items()})


@frozen(eq=False)
class HeldOut:
    """A view that methods do not get: it is to be predicted from their answer.

    Parameters
    ----------
    label
        What it is called on disk.
    steps
        View steps from the reference view to it; negative if it is to the left.
    image
        (H, W, 3) uint8, RGB.
    """

    label: str
    steps: float
    image: NDArray[np.uint8] = field(converter=_frozen_array)


@frozen(eq=False)
class Scene:
    """n rectified views taken along a line, as a rule at even steps, and ground truth for some of them.

    A point of disparity d (pixels per view step) that view `ref` sees at column x is seen by view
    j at column ``x - (j - ref) * d``, in the same row; nearer points have larger disparities. Where views
    were taken at uneven steps, ``places[j] - places[ref]`` takes the place of ``j - ref``.

    Parameters
    ----------
    name
        What the scene is called, options in brackets included.
    views
        (n, H, W, 3) uint8, RGB, from left to right; n >= 2.
    labels
        What each view is called on disk, such as ``"2"`` or ``"col3"``.
    ref
        Index of the reference view: the one that is scored.
    disparities
        The range to search, in pixels per view step.
    truth
        View index -> (H, W) float32, pixels per view step, NaN where unknown.
    pair_steps
        How many view steps lie between the two views of the field's pair. The field gives thresholds in
        pixels of that pair, so errors are multiplied by this number before they are compared with one.
    regions
        Name -> (H, W) bool mask of the reference view. They come from the full scene and do not
        change when views are chosen; `scored_regions` adds those that do.
    visible
        View index i -> (n, H, W) bool: does view j see the surface point that view i sees at this
        pixel? Only where it is known exactly (synthetic scenes).
    held_out
        A further view that is to be predicted, if that was asked for (`matbench.measures.prediction`).
    metrics
        The set of metrics that its benchmark reports (`matbench.measures.benchmarks.SETS`), such as ``hci``; empty
        if it has none.
    positions
        Where each view was taken, in view steps from the first one, if the steps are uneven; else empty.
    sparse
        Is truth known at scattered pixels only? Then nothing is derived from what lies beside or before a pixel.

    Raises
    ------
    SceneError
        If sizes, types or indices contradict one another.
    """

    name: str
    views: NDArray[np.uint8] = field(converter=_frozen_array)
    labels: tuple[str, ...]
    ref: int
    disparities: Range
    truth: Mapping[int, NDArray[np.float32]] = field(converter=_frozen_arrays)
    pair_steps: float
    regions: Mapping[str, NDArray[np.bool_]] = field(converter=_frozen_arrays, factory=dict)
    visible: Mapping[int, NDArray[np.bool_]] = field(converter=_frozen_arrays, factory=dict)
    held_out: HeldOut | None = None
    metrics: str = ""
    positions: tuple[float, ...] = field(default=(), converter=_uneven)
    sparse: bool = False

    def __attrs_post_init__(self) -> None:
        refuse_hidden("scene", self.name)
        for named in (*self.labels, *self.regions, *([self.held_out.label] if self.held_out else ())):
            refuse_hidden(f"{self.name}: view or region", named)
        shape = self.views.shape
        if len(shape) != 4 or shape[3] != 3 or self.views.dtype != np.uint8:
            raise SceneError(f"{self.name}: views are {shape} {self.views.dtype}, not (n, H, W, 3) uint8")
        if shape[0] < 2 or shape[1] < 1 or shape[2] < 1:
            raise SceneError(f"{self.name}: {shape[0]} views of {shape[2]}x{shape[1]} px; at least two, not empty")
        if len(self.labels) != shape[0]:
            raise SceneError(f"{self.name}: {shape[0]} views but {len(self.labels)} labels")
        steps = [b - a for a, b in pairwise(self.places)]
        if len(self.places) != shape[0] or self.places[0] != 0 or not all(0 < step < np.inf for step in steps):
            raise SceneError(
                f"{self.name}: views lie at {self.where}: {shape[0]} numbers that begin with 0 and increase are needed"
            )
        if not 0 <= self.ref < shape[0]:
            raise SceneError(f"{self.name}: reference view {self.ref} is not one of 0..{shape[0] - 1}")
        if not (isfinite(self.pair_steps) and self.pair_steps > 0):
            raise SceneError(f"{self.name}: pair_steps is {self.pair_steps}, not a positive number")
        for view, truth in self.truth.items():
            if not 0 <= view < shape[0] or truth.shape != shape[1:3] or truth.dtype != np.float32:
                found = f"{truth.shape} {truth.dtype}"
                raise SceneError(f"{self.name}: truth of view {view} is {found}, not {shape[1:3]} float32")
        for name, mask in self.regions.items():
            if mask.shape != shape[1:3] or mask.dtype != np.bool_:
                raise SceneError(f"{self.name}: region {name!r} is {mask.shape} {mask.dtype}, not {shape[1:3]} bool")
        for view, seen in self.visible.items():
            if seen.shape != shape[:3] or seen.dtype != np.bool_:
                found = f"{seen.shape} {seen.dtype}"
                raise SceneError(f"{self.name}: visibility of view {view} is {found}, not {shape[:3]} bool")
        if self.held_out is not None and self.held_out.image.shape != shape[1:]:
            size = self.held_out.image.shape
            raise SceneError(f"{self.name}: view {self.held_out.label}, held out, is {size}, not {shape[1:]}")

    @property
    def n(self) -> int:
        """Number of views."""
        return int(self.views.shape[0])

    @property
    def height(self) -> int:
        return int(self.views.shape[1])

    @property
    def width(self) -> int:
        return int(self.views.shape[2])

    @property
    def is_even(self) -> bool:
        """Were the views taken at even steps?"""
        return not self.positions

    @property
    def places(self) -> tuple[float, ...]:
        """Where each view was taken, in view steps from the first one."""
        return self.positions or tuple(map(float, range(self.n)))

    @property
    def where(self) -> str:
        """Where the views were taken, as messages say it."""
        return ", ".join(f"{position:g}" for position in self.places)

    def steps(self, view: int) -> float:
        """View steps from the reference view to a view; negative if that is to the left."""
        return self.places[view] - self.places[self.ref]

    def at(self, steps: float) -> int | None:
        """Index of the view that many view steps from the reference view; None if there is none."""
        found = [view for view in range(self.n) if abs(self.steps(view) - steps) <= SAME_PLACE]
        return found[0] if found else None

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything a method may see: pixels, order, reference view and range."""
        facts = f"{self.views.shape} {self.labels} {self.ref} {self.disparities} {self.pair_steps!r}"
        facts += "" if self.is_even else f" {self.positions}"
        return sha256(facts.encode() + self.views.tobytes()).hexdigest()

    @cached_property
    def truth_digest(self) -> str:
        """SHA-256 of everything the scorer adds: the reference view's truth, its regions, the view held out."""
        parts = [self.truth[self.ref].tobytes() if self.ref in self.truth else b""]
        parts += [name.encode() + mask.tobytes() for name, mask in sorted(self.regions.items())]
        if self.held_out is not None:
            parts.append(f"{self.held_out.label} {self.held_out.steps!r}".encode() + self.held_out.image.tobytes())
        return sha256(b"|".join(parts)).hexdigest()

    @cached_property
    def scored_regions(self) -> Mapping[str, NDArray[np.bool_]]:
        """`regions`, and those over the views that this scene has (`matbench.regions.view_regions`).

        The latter follow a choice of views. Without ground truth of the reference view, and with sparse one, there
        are none.
        """
        from matbench.regions import view_regions

        if self.ref not in self.truth or self.sparse:
            return self.regions
        over_views = view_regions(self.truth[self.ref], self.ref, self.n, self.visible.get(self.ref), self.places)
        return _frozen_arrays({**self.regions, **over_views})

    @property
    def out_of_range(self) -> NDArray[np.bool_]:
        """(H, W): where the reference view's truth lies outside `disparities`, so that no search can find it."""
        if self.ref not in self.truth:
            return np.zeros((self.height, self.width), bool)
        truth, rounding = self.truth[self.ref], _ROUNDING / self.pair_steps
        return (truth < self.disparities.least - rounding) | (truth > self.disparities.largest + rounding)

    def choose(self, indices: Sequence[int], name: str | None = None) -> "Scene":
        """The same scene seen by fewer views.

        Disparities, truth and `pair_steps` are rescaled to the wider view step; regions stay.

        Parameters
        ----------
        indices
            Views to keep: increasing, at least two, `ref` among them; of a scene with even steps, evenly spaced. Where
            those chosen of another one are evenly spaced, their step becomes the view step.

        Raises
        ------
        SceneError
            If they are not.
        """
        kept = list(indices)
        called = ", ".join(self.labels[i] if 0 <= i < self.n else str(i) for i in kept)
        if len(kept) < 2:
            raise SceneError(f"{self.name}: views {called or 'none'} chosen; at least two are needed")
        steps = [b - a for a, b in pairwise(kept)]
        if kept[0] < 0 or kept[-1] >= self.n or min(steps) < 1 or (self.is_even and len(set(steps)) != 1):
            possible = ", ".join(self.labels)
            raise SceneError(f"{self.name}: views {called} are not evenly spaced, left to right; possible: {possible}")
        if self.ref not in kept:
            raise SceneError(f"{self.name}: views {called} lack the reference view {self.labels[self.ref]}")
        apart = [self.places[b] - self.places[a] for a, b in pairwise(kept)]
        is_even = max(apart) - min(apart) <= SAME_PLACE
        step = apart[0] if is_even else 1.0
        place = {old: new for new, old in enumerate(kept)}
        return evolve(
            self,
            name=self.name if name is None else name,
            views=self.views[kept],
            labels=tuple(self.labels[i] for i in kept),
            ref=place[self.ref],
            disparities=self.disparities.scaled(step),
            truth={place[i]: truth * np.float32(step) for i, truth in self.truth.items() if i in place},
            pair_steps=self.pair_steps / step,
            visible={place[i]: seen[kept] for i, seen in self.visible.items() if i in place},
            held_out=self.held_out and evolve(self.held_out, steps=self.held_out.steps / step),
            positions=() if is_even else tuple(self.places[i] - self.places[kept[0]] for i in kept),
        )

    def widest(self, count: int) -> tuple[int, ...]:
        """Indices of at most `count` evenly spaced views around the reference view: every k-th one.

        The widest spacing that fits wins, then the choice that has the reference view nearest to
        its middle, then the one that reaches further right. On the paper's scenes four views are
        Tsukuba col2-5, Rocks1 view0-3 and Teddy im0, 2, 4, 6, as in the paper.
        """
        if count < 2:
            raise SceneError(f"{self.name}: {count} views asked for; at least two are needed")
        found = evenly_spaced(self.n, self.ref, min(count, self.n))
        assert found, "neighbours of the reference view always fit"  # noqa: S101
        return found


def evenly_spaced(n: int, ref: int, count: int, baseline: int | None = None) -> tuple[int, ...]:
    """Indices of `count` >= 2 evenly spaced views of n, `ref` among them; none if they do not fit.

    Parameters
    ----------
    baseline
        View steps from the first to the last of them; the widest that fits if not given. Of
        several choices the one that has the reference view nearest to its middle is taken, then
        the one that reaches further right.
    """
    fits = [
        (step, -abs(2 * place - (count - 1)), -place, ref - place * step)
        for step in range(1, (n - 1) // (count - 1) + 1)
        for place in range(count)
        if ref - place * step >= 0 and ref + (count - 1 - place) * step < n
        if baseline in (None, step * (count - 1))
    ]
    if not fits:
        return ()
    step, _, _, first = max(fits)
    return tuple(range(first, first + count * step, step))
