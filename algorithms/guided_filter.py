"""Costs of every plane smoothed by the guided filter, and the plane of least cost (Rhemann et al. 2011)."""

from collections.abc import Mapping
from typing import get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.features import gradient, luma
from matbench.algorithms.guidance import BYTES, Guidance
from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.kernels import kernel, literal
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, planes_a_pixel
from matbench.algorithms.peak_ratio import peak_ratio
from matbench.algorithms.sampling import OnGrid, by_phase, fine_rows
from matbench.algorithms.selection import Selection, select
from matbench.algorithms.semiglobal import winner
from matbench.algorithms.sweep import SOURCES, Costs, Source, Sweep
from matbench.algorithms.weighted_median import weighted_median
from matbench.scene import Scene
from matbench.space import surface

COLOUR, SLOPE = 7.0, 2.0  # grey levels at which the differences of colours and of gradients are cut off
MEDIAN_RADIUS, MEDIAN_SPACE, MEDIAN_COLOUR = 9, 9.0, 0.1


@frozen
class GuidedFilter(OnGrid):
    """For each pixel the plane whose cost, smoothed within the outlines of the view, is least (CostFilter).

    C = (1 - slopes) min(mean |dI|, 7) + slopes min(|dg|, 2)

    with the colours I and the horizontal gradient g of the luma, in grey levels. The costs of every plane are
    smoothed by the guided filter, with the colours of the view as the guide (`Guidance`). Then, if `check`, a
    pixel keeps its plane if at least half of the other views that hold the point have the same plane there.
    Holes take the farther plane of their row's, and then the weighted median of their surroundings (`weighted_median`).

    Source: C. Rhemann, A. Hosni, M. Bleyer, C. Rother, M. Gelautz, "Fast cost-volume filtering for visual
    correspondence and beyond", CVPR 2011 (IEEE PAMI 35(2), 2013), for two views. Costs of several views are
    averaged before they are smoothed, and a pixel needs half of the views: choices; for two views both are as
    published. The constants of the median are from memory of the authors' program.

    Parameters
    ----------
    similarity, views, fineness, selection
        See `Costs`.
    slopes
        How much the gradient weighs, 0 to 1.
    radius
        Of the filter's windows, in pixels.
    epsilon
        Variance of the colours (of 0 to 1) below which a window is flat.
    check
        Infer the maps of all views, and fill what they contradict? Else only the reference view's.
    """

    similarity: Source = field(default="published", validator=SOURCES)
    views: int = field(default=9, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)
    selection: Selection = field(default="mean", validator=validators.in_(get_args(Selection)))
    slopes: float = field(default=0.89, validator=[validators.ge(0), validators.le(1)])
    radius: int = field(default=9, validator=[validators.ge(1), validators.le(99)])
    epsilon: float = field(default=1e-4, validator=validators.gt(0))
    check: bool = True

    @property
    def _costs(self) -> Costs:
        return Costs(self.similarity, self.views, self.fineness, selection=self.selection)

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        own = {} if self.similarity == "published" else {"slopes": "similarity=published"}
        return own | {name: why for name, why in self._costs.silent.items() if name == "selection"}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities with an answer everywhere, of all chosen views with `check`; then also the 0/1 surface."""
        sweep = Sweep.of(scene, self._costs, context.threads)
        space, images, ref = sweep.space, sweep.scene.views, sweep.scene.ref
        rows = fine_rows(images, space.fineness)
        slopes = np.asarray(by_phase(gradient(luma(rows), space.fineness), space.fineness), np.float32)
        chosen = range(space.views) if self.check else [ref]
        ways = {view: sweep.with_reference(view) for view in chosen}
        found, sure = {}, np.empty(0, np.float32)
        for view, way in ways.items():
            found[view], ratios = self._winner(way, slopes, context.threads)
            if view == ref:
                sure = ratios
        held = sweep.volume_bytes + BYTES * space.rows * space.width
        if not self.check:
            work = sweep.work | {"volume_bytes": held}
            return Estimate({scene.ref: sweep.disparity(found[ref])}, work=work, confidence={scene.ref: sure})
        maps, filled = {}, 0
        for view, way in ways.items():
            kept = agreed(way, found)
            filled += int((~kept).sum())
            if view == ref:
                sure[~kept] = 0
            maps[view] = fill(found[view], kept, images[view], context.threads)
        disparity = {sweep.indices[view]: sweep.disparity(planes) for view, planes in maps.items()}
        work = {name: sum(way.compared[name] for way in ways.values()) for name in sweep.compared}
        volume = None
        if context.volume and sweep.scene.is_even:
            q = space.fineness
            nearest = (np.arange(space.samples) + q // 2) // q  # of the pixels of a row, to each sample
            steps = {
                view: (planes[:, nearest] + np.float32(space.first)) / np.float32(q) for view, planes in maps.items()
            }
            volume = surface(space, steps, sweep.indices)
        work |= {"pixels_filled": filled, "volume_bytes": held}
        return Estimate(disparity, volume, work=work, confidence={scene.ref: sure})

    def _winner(
        self, sweep: Sweep, slopes: NDArray[np.float32], threads: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(H, W) planes of the least smoothed cost, and how sure they are (`peak_ratio`)."""
        space, ref = sweep.space, sweep.scene.ref
        guide = Guidance.of(sweep.scene.views[ref], self.radius, self.epsilon)
        shared = sweep.cost(threads) if self.similarity != "published" else None
        smoothed = np.empty((space.rows, space.planes, space.width), np.float32)

        def smooth(first: int, end: int) -> None:
            for plane in range(first, end):
                cost = self._cost(sweep, slopes, plane) if shared is None else np.ascontiguousarray(shared[:, :, plane])
                smoothed[:, plane] = guide.filter(cost)

        over_rows(smooth, space.planes, threads, 1)
        found = np.asarray(winner(smoothed, smoothed))
        return found, peak_ratio(smoothed, found, threads)

    def _cost(self, sweep: Sweep, slopes: NDArray[np.float32], plane: int) -> NDArray[np.float32]:
        """(H, W) costs C of a plane over the views; where no view holds a point, the largest there is."""
        ref, share = sweep.scene.ref, np.float32(self.slopes)
        each = np.full((len(sweep.others), sweep.space.rows, sweep.space.width), np.nan, np.float32)
        for place, view in enumerate(sweep.others):
            here, phase, there = sweep.homologues(view, plane)
            match(
                sweep.phases[ref, 0, :, :, here], sweep.phases[view, phase, :, :, there],
                slopes[ref, 0, :, here], slopes[view, phase, :, there], share, each[place, :, here],
            )  # fmt: skip
        cost = select(each, self.selection, ref)
        return np.where(np.isnan(cost), (1 - share) * np.float32(COLOUR) + share * np.float32(SLOPE), cost)


def agreed(sweep: Sweep, maps: Mapping[int, NDArray[np.float32]]) -> NDArray[np.bool_]:
    """(H, W) do at least half of the views that hold the point of a pixel have its plane there, to the whole plane?"""
    whole = {view: np.rint(planes).astype(np.int32) for view, planes in maps.items()}
    own = whole[sweep.scene.ref]
    held, same = np.zeros(own.shape, np.int32), np.zeros(own.shape, np.int32)
    for view in sweep.others:
        spans = [sweep.whole_homologues(view, plane) for plane in range(sweep.space.planes)]
        shifts = np.array([[here.start, here.stop, there.start - here.start] for here, there in spans])
        count_agreeing(own, whole[view], shifts, held, same)
    return (held > 0) & (2 * same >= held)


@literal
def _match_row(one, other, slope, steep, share, out):  # type: ignore[no-untyped-def]
    for x in range(out.size):
        colour = np.float32(0)
        for c in range(3):
            colour += abs(one[c, x] - other[c, x])
        colour = min(colour / np.float32(3), np.float32(COLOUR))
        out[x] = (np.float32(1) - share) * colour + share * min(abs(slope[x] - steep[x]), np.float32(SLOPE))


@kernel
def match(one, other, slope, steep, share, out):  # type: ignore[no-untyped-def]
    """out <- (H, W) costs C of two views' colours (3, H, W) and gradients (H, W)."""
    for y in range(out.shape[0]):
        _match_row(one[:, y], other[:, y], slope[y], steep[y], share, out[y])


@kernel
def count_agreeing(own, other, shifts, held, same):  # type: ignore[no-untyped-def]
    """Count the pixels whose point another view holds, and those of them whose plane it has there.

    Parameters
    ----------
    own, other
        (H, W) int32 planes of both views.
    shifts
        (planes, 3): the first column whose homologue the other view holds, the end of these, and how far it is.
    held, same
        (H, W) int32, to be raised.
    """
    for y in range(own.shape[0]):
        for x in range(own.shape[1]):
            plane = own[y, x]
            if 0 <= plane < shifts.shape[0] and shifts[plane, 0] <= x < shifts[plane, 1]:
                held[y, x] += 1
                same[y, x] += other[y, x + shifts[plane, 2]] == plane


def fill(
    planes: NDArray[np.float32], kept: NDArray[np.bool_], image: NDArray[np.uint8], threads: int
) -> NDArray[np.float32]:
    """Planes whose holes take the farther plane of their row's, then the weighted median; whole ones in holes."""
    if not kept.any():
        return planes
    full = fill_from_background(np.where(kept, planes, np.float32(np.nan)))
    whole = np.maximum(np.rint(full), 0).astype(np.int32)
    median = weighted_median(whole, image, ~kept, MEDIAN_RADIUS, MEDIAN_SPACE, MEDIAN_COLOUR, threads)
    return np.where(kept, planes, median).astype(np.float32)
