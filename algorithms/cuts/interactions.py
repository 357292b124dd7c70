"""What two views' homologous pixels differ by, in every plane: costs of interactions between views."""

from collections.abc import Mapping
from functools import partial

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.algorithms.cuts.lattice import whole_shifts
from matbench.algorithms.cuts.ranges import Ranges
from matbench.algorithms.fusion import Fusion
from matbench.algorithms.kernels import kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.sweep import Costs, Difference, Source, Sweep
from matbench.algorithms.windows import Features
from matbench.scene import Scene
from matbench.space import DisparitySpace

UNITS: Mapping[str, float] = {"squared": 64.0, "absolute": 1024.0, "shared": 2.0**14, "mccnn": 2.0**14}
UNKNOWN = 65535  # where two pixels are no pair
MOST = 32767  # units of a reward, which fits into 16 bits


@kernel
def join_ways(forth, back, shifts, units, top, end, out):  # type: ignore[no-untyped-def]
    """out <- the mean of what the pixels of a pair differ by, seen from either; UNKNOWN where they are no pair.

    Parameters
    ----------
    forth, back
        (H, planes, W) float32 at the pixels of the left view and of the right one; NaN outside the other.
    shifts
        (planes,) from the left view's columns to the right one's, whole pixels.
    units
        In one unit of the differences.
    out
        (H, planes, W) uint16 at the pixels of the left view.
    """
    width = forth.shape[2]
    for y in range(top, end):
        for k in range(forth.shape[1]):
            for x in range(width):
                out[y, k, x] = UNKNOWN
                at = x + shifts[k]
                if at < 0 or at >= width:
                    continue
                one, other = forth[y, k, x], back[y, k, at]
                mean = (one + other) / np.float32(2)
                if one != one:
                    mean = other
                elif other != other:
                    mean = one
                if mean == mean:
                    out[y, k, x] = np.uint16(min(mean * units + np.float32(0.5), np.float32(UNKNOWN - 1)))


@frozen(eq=False)
class Interactions:
    """The pairs of pixels of several views that may see the same point, and what they differ by.

    Parameters
    ----------
    pairs
        (pairs, 2) views, the left one first.
    shifts
        (pairs, planes), see `whole_shifts`.
    differences
        (pairs, H, planes, W) uint16 at the pixels of the left view, in units; UNKNOWN where there is no pair.
    units
        In one unit of the difference: a squared grey level, a grey level, or the largest that similarities differ by.
    """

    pairs: NDArray[np.int64]
    shifts: NDArray[np.int64]
    differences: NDArray[np.uint16]
    units: float

    @classmethod
    def of(
        cls,
        scene: Scene,
        space: DisparitySpace,
        pairs: NDArray[np.int64],
        similarity: Source,
        threads: int,
        difference: Difference = "squared",
        by_ranges: bool = False,
    ) -> "Interactions":
        """Compare homologous pixels in all planes.

        They are compared exactly where they are, between pixels too, from the whole pixels of either view; the mean
        counts. ``published``: a `difference` of colours, see `Costs`. ``shared``: 1 - rho_ij over adaptive
        windows, of which the first costs of materiality and its control are made (`Fusion.first_cost`); ``mccnn``:
        the same of learned similarities. With `by_ranges` colours count as squared differences of `Ranges`.
        """
        shifts, units = whole_shifts(space, pairs), UNITS[difference if similarity == "published" else similarity]
        out = np.empty((len(pairs), space.rows, space.planes, space.width), np.uint16)
        sweep = Sweep.of(scene, Costs(similarity, scene.n, space.fineness, difference), threads)
        phases = None if sweep.matcher is None else sweep.matcher.phases()
        ranges = Ranges.of(sweep.phases) if by_ranges and sweep.matcher is None else None
        seen = partial(_differences, sweep, phases, ranges, threads)
        for p, (i, j) in enumerate(pairs.tolist()):
            join = partial(join_ways, seen(i, j), seen(j, i), shifts[p], np.float32(units))
            over_rows(lambda top, end, join=join, out=out[p]: join(top, end, out), space.rows, threads)  # type: ignore[misc]
        return cls(pairs, shifts, out, units)

    def usual_difference(self, both_ways: bool = False) -> float:
        """What homologues of the first plausible planes usually differ by; the authors' rule for K.

        The mean, over pixels and pairs, of one of the smallest differences over the planes: that of rank
        (planes + 2) / 4, but at least the third. Pixels are those of the left views; `both_ways`, of either view, so
        that it is the same in a mirror.
        """
        planes = self.differences.shape[2]
        rank = min(planes, max(3, (planes + 2) // 4)) - 1
        total, count = 0, 0
        for part, shifts in zip(self.differences, self.shifts, strict=True):
            for seen in (part, _from_right(part, shifts)) if both_ways else (part,):
                ranked = np.partition(seen, rank, axis=1)[:, rank]
                known = ranked[ranked != UNKNOWN]
                total, count = total + int(known.sum(dtype=np.int64)), count + known.size
        return total / max(1, count) / self.units

    def rewards(self, most: float) -> NDArray[np.int16]:
        """(pairs, H, planes, W) min(0, difference - most) in units: never positive, and 0 where there is no pair."""
        limit = round(min(most * self.units, MOST))
        # what is UNKNOWN is above any limit
        return np.stack([np.minimum(part, limit).astype(np.int16) - np.int16(limit) for part in self.differences])


def _from_right(part: NDArray[np.uint16], shifts: NDArray[np.int64]) -> NDArray[np.uint16]:
    """The (H, planes, W) differences of a pair at the pixels of the right view."""
    out, width = np.full_like(part, UNKNOWN), part.shape[2]
    for plane, shift in enumerate(shifts.tolist()):
        low, high = max(0, -shift), min(width, width - shift)
        if low < high:
            out[:, plane, low + shift : high + shift] = part[:, plane, low:high]
    return out


def _differences(
    sweep: Sweep, phases: Features | None, ranges: Ranges | None, threads: int, i: int, j: int
) -> NDArray[np.float32]:
    """(H, planes, W) what the pixels of view i and their homologues in view j differ by; NaN outside view j."""
    space, own = sweep.space, sweep.with_reference(i)
    if own.matcher is not None:
        alone = evolve(own.matcher, pairs=np.array([sorted((i, j))], np.int64))
        cost = Fusion().first_cost(alone, threads, phases)
        for plane, (low, count) in enumerate(alone.ray_spans(i, j)[:, :2]):
            cost[:, plane, :low] = np.nan
            cost[:, plane, low + count :] = np.nan
        return cost
    out = np.empty((space.rows, space.planes, space.width), np.float32)

    def compare(first: int, end: int) -> None:
        for plane in range(first, end):
            out[:, plane] = own.difference(j, plane) if ranges is None else ranges.difference(own, j, plane)

    over_rows(compare, space.planes, threads, 1)
    return out
