"""Plane sweep: what the pixels of one view cost in every plane, compared with each of the other views.

The costs of all methods that stand beside materiality come from here, their own or those that materiality uses.
"""

from collections.abc import Mapping
from typing import Literal, get_args

import cv2
import numpy as np
from attrs import evolve, field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithms import mccnn
from matbench.algorithms.fusion import Fusion
from matbench.algorithms.kernels import kernel, literal
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, odd, planes_a_pixel, unread
from matbench.algorithms.sampling import by_phase, fine_rows, grid, off_grid, search_space
from matbench.algorithms.selection import Selection, select
from matbench.algorithms.similarity import Form, Matcher, Matching
from matbench.scene import Scene, SceneError
from matbench.space import DisparitySpace

Source = Literal["published", "shared", "mccnn"]
SOURCES = [validators.in_(get_args(Source)), mccnn.installed]
"""Validators of a `Source`."""
Difference = Literal["absolute", "squared"]


@frozen
class Costs:
    """What a pixel costs in a plane. A group of parameters.

    Parameters
    ----------
    similarity
        ``published``: differences of colours, as the source of the method has them. ``shared``: the costs
        that materiality and its control begin with, `Fusion.first_cost` of a `Matching` with its own
        defaults. Methods that share their costs differ in how they reason only. ``mccnn``: the same with
        ``similarity=mccnn``, a learned one.
    views
        Use at most this many of the scene's views, as widely spaced as they fit; 0 for all.
    fineness
        Planes per pixel of view step; 0 makes them at most one pixel of the field's pair apart.
    difference
        Of two pixels, mean over the colours: ``absolute``, in grey levels, or ``squared``.
    truncation
        Grey levels. A difference counts at most as one of this many (its square, if ``squared``); 0 = no limit.
    window
        Side of the square window in pixels, odd; the cost of a pixel is the mean over its window.
    shiftable
        Does a pixel take the best of all windows that contain it, rather than the one around it?
    selection
        Of the views that hold a point: the ``mean`` over all, over the better ``half`` (rounded up), or over
        the better ``side`` of the reference view. Each view's cost is that of its whole window.
    """

    similarity: Source = field(default="published", validator=SOURCES)
    views: int = field(default=9, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)
    difference: Difference = field(default="absolute", validator=validators.in_(get_args(Difference)))
    truncation: float = field(default=0.0, validator=validators.ge(0))
    window: int = field(default=1, validator=odd)
    shiftable: bool = False
    selection: Selection = field(default="half", validator=validators.in_(get_args(Selection)))

    @property
    def silent(self) -> Mapping[str, str]:
        """Parameter -> what it needs to have an effect, for those that are not read beside the others."""
        own, several = self.similarity == "published", self.views != 2
        takes = {
            "difference": (own, "similarity=published"),
            "truncation": (own, "similarity=published"),
            "selection": (own and several, "views other than 2" if own else "similarity=published"),
            "shiftable": (self.window > 1, "window above 1"),
        }
        return unread(takes)


@frozen(eq=False)
class Sweep:
    """The costs of one scene's pixels in every plane.

    Parameters
    ----------
    scene
        The chosen views.
    indices
        Which views of the given scene they are; in order.
    space
        Target points of the chosen views.
    phases
        (views, q, 3, H, W) float32 colours, see `by_phase`.
    settings
        What a cost is.
    matcher
        The similarities, if the costs are made of them: ``shared`` or ``mccnn``.
    places
        Where each chosen view lies, in steps of the space.
    step
        View steps of the given scene in a step of the space.
    """

    scene: Scene
    indices: tuple[int, ...]
    space: DisparitySpace
    phases: NDArray[np.float32]
    settings: Costs
    matcher: Matcher | None
    places: tuple[int, ...]
    step: float

    @classmethod
    def of(cls, scene: Scene, settings: Costs, threads: int = 1) -> "Sweep":
        """Choose views and planes, and sample the rows."""
        indices = scene.widest(settings.views or scene.n)
        laid = grid(scene.choose(indices))
        if laid is None:
            raise SceneError(f"{scene.name}: {off_grid(scene.choose(indices))}")
        chosen, places = laid
        space = search_space(chosen, settings.fineness)
        phases = np.asarray(by_phase(fine_rows(chosen.views, space.fineness), space.fineness), np.float32)
        form: Form = "mccnn" if settings.similarity == "mccnn" else "mixed"
        matching = Matching(views=settings.views, fineness=settings.fineness, similarity=form)
        matcher = None if settings.similarity == "published" else Matcher.of(scene, matching, threads)
        step = scene.pair_steps / chosen.pair_steps
        return cls(chosen, indices, space, phases, settings, matcher, places, step)

    def with_reference(self, view: int) -> "Sweep":
        """The same views, swept from another of them."""
        scene = evolve(self.scene, ref=view, regions={})
        return evolve(self, scene=scene, matcher=self.matcher and self.matcher.with_reference(view))

    @property
    def others(self) -> list[int]:
        """The views that the reference view is compared with, from left to right."""
        return [view for view in range(self.space.views) if view != self.scene.ref]

    def disparity(self, planes: NDArray[np.floating]) -> NDArray[np.float32]:
        """Fractional plane indices of the space as disparities in pixels per view step of the given scene."""
        scale = np.float32(1 / (self.space.fineness * self.step))
        return np.asarray((planes + np.float32(self.space.first)) * scale, np.float32)

    def _back(self, view: int) -> int:
        """Steps of the space from a view to the reference view."""
        return self.places[self.scene.ref] - self.places[view]

    def homologues(self, view: int, plane: int) -> tuple[slice, int, slice]:
        """Columns of the reference view in another view: which ones, the phase there, and the whole pixels there.

        All homologues in a plane have the same phase, so they are exact in rows sorted by it.
        """
        width, q = self.space.width, self.space.fineness
        whole, phase = divmod(self._back(view) * (self.space.first + plane), q)
        low = min(width, max(0, -whole))
        high = max(low, min(width, width - whole - (phase > 0)))
        return slice(low, high), phase, slice(low + whole, high + whole)

    def difference(self, view: int, plane: int) -> NDArray[np.float32]:
        """(H, W) difference of every pixel of the reference view and its homologue in a view; NaN outside that view."""
        here, phase, there = self.homologues(view, plane)
        squares, limit = self.settings.difference == "squared", self.settings.truncation or np.inf
        out = np.full((self.space.rows, self.space.width), np.nan, np.float32)
        one, other = self.phases[self.scene.ref, 0, :, :, here], self.phases[view, phase, :, :, there]
        compare(one, other, squares, np.float32(limit**2 if squares else limit), out[:, here])
        return out

    def cost(self, threads: int = 1, nearest: NDArray[np.int32] | None = None) -> NDArray[np.float32]:
        """(H, W, planes) costs of the reference view's pixels; NaN where no other view holds the point.

        Parameters
        ----------
        nearest
            (views, H, W) the plane in which each view's pixel meets a surface, -1 where it is not known to meet any.
            Then a view counts only for the points that it sees: those at most one plane behind (a slanted surface
            must not hide itself). A point that no view sees keeps the cost that it has without. Shared costs do not
            read it.
        """
        space = self.space
        planes = np.empty((space.planes, space.rows, space.width), np.float32)
        fused = None if self.matcher is None else Fusion().first_cost(self.matcher, threads)

        def sweep(first: int, end: int) -> None:
            for plane in range(first, end):
                if fused is None:
                    planes[plane] = self._selected(plane, nearest)
                else:
                    planes[plane] = self._aggregate(np.ascontiguousarray(fused[:, plane]))

        over_rows(sweep, space.planes, threads, 1)
        return np.ascontiguousarray(np.moveaxis(planes, 0, 2))

    def _selected(self, plane: int, nearest: NDArray[np.int32] | None) -> NDArray[np.float32]:
        """The costs of a plane over the windows and the selected views."""
        each = np.stack([self._aggregate(self.difference(view, plane)) for view in self.others])
        cost = select(each, self.settings.selection, self.scene.ref)
        if nearest is None:
            return cost
        for place, view in enumerate(self.others):
            here, there = self.whole_homologues(view, plane)
            each[place, :, here][nearest[view, :, there] > plane + 1] = np.nan
        seen = select(each, self.settings.selection, self.scene.ref)
        return np.where(np.isnan(seen), cost, seen)

    def whole_homologues(self, view: int, plane: int) -> tuple[slice, slice]:
        """Columns of the reference view and those of another view nearest to their homologues.

        A half is rounded away from 0, so that the way back is the same.
        """
        width, q = self.space.width, self.space.fineness
        samples = self._back(view) * (self.space.first + plane)
        shift = (2 * abs(samples) + q) // (2 * q) * (1 if samples > 0 else -1)
        low = min(width, max(0, -shift))
        high = max(low, min(width, width - shift))
        return slice(low, high), slice(low + shift, high + shift)

    def seen_from(self, planes: NDArray[np.int32]) -> NDArray[np.int32]:
        """(views, H, W) the nearest plane that each view sees of a map of the reference view; -1 where it sees none."""
        nearest = np.full((self.space.views, *planes.shape), -1, np.int32)
        for view in range(self.space.views):
            for plane in range(self.space.planes):  # what is nearer comes later
                here, there = self.whole_homologues(view, plane)
                nearest[view, :, there][planes[:, here] == plane] = plane
        return nearest

    def _aggregate(self, cost: NDArray[np.float32]) -> NDArray[np.float32]:
        """The costs of a plane over the windows."""
        side = self.settings.window
        if side == 1:
            return cost
        mean = box(cost, side)
        return best_window(mean, side) if self.settings.shiftable else mean

    @property
    def compared(self) -> dict[str, int]:
        """How many pairs of pixels or windows `cost` compares."""
        if self.matcher is not None:
            return {"pair_similarities": self.matcher.ray_comparisons}
        spans = [self.homologues(view, plane)[0] for view in self.others for plane in range(self.space.planes)]
        return {"pixel_differences": self.space.rows * sum(span.stop - span.start for span in spans)}

    @property
    def volume_bytes(self) -> int:
        """Bytes of the volumes that `cost` holds at once."""
        volume = 4 * self.space.planes * self.space.rows * self.space.width
        return (2 if self.matcher is None else 3) * volume

    @property
    def work(self) -> dict[str, int]:
        """What `cost` takes."""
        return {**self.compared, "volume_bytes": self.volume_bytes}


@literal
def _compare_row(one, other, squares, limit, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):
        total = np.float32(0)
        for c in range(one.shape[0]):
            gap = one[c, x] - other[c, x]
            total += gap * gap if squares else abs(gap)
        out[x] = min(total / np.float32(one.shape[0]), limit)


@kernel
def compare(one, other, squares, limit, out):  # type: ignore[no-untyped-def]
    """out <- the mean over the colours of what two views (3, H, W) differ by, at most a limit: (H, W)."""
    for y in range(out.shape[0]):
        _compare_row(one[:, y], other[:, y], squares, limit, out[y])


def box(values: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """The mean over a square window of (H, W) values; what is NaN or outside the picture does not count.

    NaN stays NaN.
    """
    known = np.isfinite(values)
    count = window_sums(known.astype(np.float32), side)
    total = window_sums(np.where(known, values, np.float32(0)), side)
    return np.where(known, total / np.maximum(count, 1), np.float32(np.nan)).astype(np.float32)


def window_sums(values: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """Sums over a square window of (H, W) or (H, W, channels) values; beyond the picture is nothing."""
    sums = cv2.boxFilter(values, -1, (side, side), normalize=False, borderType=cv2.BORDER_CONSTANT)
    return np.asarray(sums, np.float32)


def best_window(means: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """The least of (H, W) means over the windows that contain a pixel; a window has its centre in the picture.

    Centres with NaN do not count, and NaN stays NaN.
    """
    none = np.float32(np.inf)
    known = np.isfinite(means)
    centres = np.where(known, means, none)
    tall, wide = np.ones((side, 1), np.uint8), np.ones((1, side), np.uint8)
    least = cv2.erode(centres, tall, borderType=cv2.BORDER_CONSTANT, borderValue=float("inf"))
    least = cv2.erode(least, wide, borderType=cv2.BORDER_CONSTANT, borderValue=float("inf"))
    return np.where(known, least, np.float32(np.nan)).astype(np.float32)


def filled(cost: NDArray[np.float32]) -> NDArray[np.float32]:
    """(H, W, planes) costs without NaN: an unknown one is the mean of the pixel's known ones, so that it says nothing.

    A pixel without any known cost costs 0 everywhere. The costs are changed in place, as a copy may be large.
    """
    known = np.isfinite(cost)
    if not known.all():
        mean = np.add.reduce(cost, axis=2, where=known) / np.maximum(known.sum(axis=2), 1)
        np.copyto(cost, mean[:, :, None], where=~known, casting="same_kind")
    return cost
