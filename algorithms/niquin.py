"""Maps of all views at once, which rate what matches and what is occluded together (Niquin, Prevost & Remion 2010)."""

from collections.abc import Mapping
from functools import partial
from typing import ClassVar

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.cuts.interactions import UNKNOWN, Interactions
from matbench.algorithms.cuts.lattice import Lattice, disparities, expand_views, surfaces, whole_shifts
from matbench.algorithms.cuts.moves import Moves
from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, planes_a_pixel
from matbench.algorithms.ray_ends import agreement
from matbench.algorithms.sampling import search_space
from matbench.algorithms.similarity import pairs as view_pairs
from matbench.algorithms.smoothness import Smoothness
from matbench.algorithms.sweep import SOURCES, Source
from matbench.parameters import flat
from matbench.scene import Scene

SCALE = {
    "published": 20.0,
    "shared": 1.0,
    "mccnn": 1.0,
}  # what a dissimilarity counts at most: grey levels, and all of it
OWN = {"published": 2.0, "shared": 0.05, "mccnn": 0.05}  # smoothness


@flat
@frozen
class Niquin:
    """Maps f of all views at once, with the least

    E = sum over the pixels of all views of (Delta + occlusion * scale * hidden / views)
    + sum over the neighbours p, q of each view of w_pq min(|f_p - f_q|, step)

    that expansion moves find, among the maps in which no view sees through a surface of the view beside it. The match
    of a pixel is its homologues in all views. Of these, a view sees the point unless its own map is nearer there by
    more than one plane, so that slanted surfaces do not hide themselves; the others, and those that do not hold the
    point, are `hidden` in number. Delta is the mean dissimilarity of consecutive views that both see it. Who sees what
    follows from the maps of the pass before, at first none: nothing is hidden then. The plane that a pixel has would
    give way if it took another one: farther planes are hidden by what hides its own. A pass offers every plane
    once to all pixels of all views. After the first, one counts only if E, with what its own maps hide, falls. The
    history holds E per pixel after each pass that counts.

    The consistency of all views' maps, and that dissimilarity and occlusion are rated together, is the source's; the
    formulas are reconstructed. See docs/concepts/graph-cuts.md.

    Source: C. Niquin, S. Prevost, Y. Remion, "An occlusion approach with consistency constraint for
    multiscopic depth extraction", International Journal of Digital Multimedia Broadcasting, 2010.

    Parameters
    ----------
    similarity
        ``published``: a dissimilarity is the mean absolute difference of the colours, at most 20 grey levels
        (the scale). ``shared``: 1 - rho, of which the first costs of materiality and its control are made
        (`Fusion.first_cost`); the scale is 1. ``mccnn``: the same of learned similarities.
    views
        Use at most this many of the scene's views, as widely spaced as they fit; 0 for all.
    fineness
        Planes per pixel of view step; 0 makes them at most one pixel of the field's pair apart.
    occlusion
        What a point costs that no other view sees, in shares of the scale.
    step
        How many planes a change of plane counts at most; with 1 every change costs the same (Potts).
    """

    by_default: ClassVar[bool] = False

    similarity: Source = field(default="published", validator=SOURCES)
    views: int = field(default=5, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)
    occlusion: float = field(default=0.2, validator=[validators.ge(0), validators.le(10)])
    prices: Smoothness = field(factory=Smoothness)
    step: int = field(default=2, validator=validators.ge(1))
    moves: Moves = field(factory=partial(Moves, rounds=1))

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        return self.prices.silent

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The maps of all views that are used."""
        indices = scene.widest(self.views or scene.n)
        chosen = scene.choose(indices)
        space, threads, moves = search_space(chosen, self.fineness), context.threads, self.moves
        pairs = view_pairs(chosen.n, "consecutive")
        between = Interactions.of(chosen, space, pairs, self.similarity, threads, "absolute")
        units, scale = between.units, SCALE[self.similarity]
        weights = [self.prices.weights(view, OWN[self.similarity]) for view in chosen.views]
        down, right = (np.rint(np.stack(part) * units).astype(np.int32) for part in zip(*weights, strict=True))
        nothing = np.zeros((0, 0, 0, 0), np.int16)
        every = np.array([(i, j) for i in range(chosen.n) for j in range(chosen.n)], np.int64)
        shifts = whole_shifts(space, every).reshape(chosen.n, chosen.n, space.planes)
        shifts = np.where(np.tri(chosen.n, k=-1, dtype=bool)[..., None], -shifts.swapaxes(0, 1), shifts)
        hidden, limit = round(self.occlusion * scale * units / chosen.n), round(scale * units)

        def rated(labels: NDArray[np.int32]) -> Lattice:
            """The lattice whose pixels cost what the maps of these labels let be seen."""
            alone = np.empty((space.rows, chosen.n, space.planes, space.width), np.int32)
            rate = partial(rate_matches, labels, between.differences, shifts, hidden, limit)
            over_rows(lambda top, end: rate(top, end, alone), space.rows, threads)
            return Lattice(pairs, between.shifts, nothing, alone, down, right, self.step, units)

        labels = np.zeros((space.rows, chosen.n, space.width), np.int32)  # hides nothing, and violates nothing
        lattice = rated(labels)
        energies: list[float] = []
        expansions, arcs = 0, 0
        for _ in range(moves.rounds):
            found = expand_views(lattice, labels, 1, moves.order, moves.flow, threads)
            expansions, arcs = expansions + found.expansions, arcs + found.arcs
            lattice = rated(found.labels)
            energy = lattice.energy(found.labels)
            if energies and energy >= energies[-1]:
                break
            labels = found.labels
            energies.append(energy)
        maps = disparities(space, labels)
        step = np.float32(indices[1] - indices[0])
        return Estimate(
            disparity={index: maps[i] / step for i, index in enumerate(indices)},
            confidence={scene.ref: agreement(maps, chosen.ref, 1 / chosen.pair_steps, threads)},
            volume=surfaces(space, maps, indices) if context.volume else None,
            history={"energy": energies},
            work={
                "expansions": expansions,
                "arcs": arcs,
                "violations": lattice.violations(labels),
                "volume_bytes": between.differences.nbytes + 2 * lattice.alone.nbytes,
            },
        )


@kernel
def rate_matches(labels, differences, shifts, hidden, limit, top, end, out):  # type: ignore[no-untyped-def]
    """What every pixel of every view costs in every plane, if the maps of these labels hide what is behind them.

    Parameters
    ----------
    labels
        (H, views, W) planes of the maps.
    differences
        (views - 1, H, planes, W) uint16 of consecutive views, at the pixels of the left one.
    shifts
        (views, views, planes) columns from a pixel to its homologue in another view.
    hidden
        What each view costs that does not see a point, in units.
    limit
        What a difference counts at most.
    top, end
        The rows to write.
    out
        (H, views, planes, W) int32.
    """
    _, views, width = labels.shape
    before, sees = np.empty(width, np.int32), np.empty(width, np.int32)
    seeing, compared, total = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
    for y in range(top, end):
        for i in range(views):
            for k in range(out.shape[2]):
                for x in range(width):
                    before[x], seeing[x], compared[x], total[x] = 0, 0, 0, 0
                for j in range(views):
                    shift = shifts[i, j, k]
                    _see(labels[y, j], shift, k, labels[y, i], sees)
                    for x in range(width):
                        seeing[x] += sees[x]
                    if j > 0:
                        # what is nearer to view i counts: after rounding, the two need not be homologues
                        left = shifts[i, j - 1, k] if i < j else shift - shifts[j - 1, j, k]
                        _compare(differences[j - 1, y, k], left, limit, before, sees, compared, total)
                    before, sees = sees, before
                for x in range(width):
                    # the quotient of numbers as small as these is exact enough to be rounded down
                    mean = np.int32(np.float64(total[x]) / max(compared[x], 1))
                    out[y, i, k, x] = hidden * (views - seeing[x]) + mean


@helper
def _see(labels, shift, k, own, sees):  # type: ignore[no-untyped-def]
    """sees <- is a homologue in the picture, and its label at most k or the pixel's own, or one more?"""
    width = sees.size
    low, high = min(max(-shift, 0), width), max(min(width - shift, width), 0)
    for x in range(width):
        sees[x] = 0
    if low < high:  # slices, so that nothing but what is added up depends on where they begin
        there, mine, here = labels[low + shift : high + shift], own[low:high], sees[low:high]
        for x in range(here.size):
            here[x] = there[x] <= max(k, mine[x]) + 1


@helper
def _compare(differences, shift, limit, one, other, compared, total):  # type: ignore[no-untyped-def]
    """Where both views see the point and their difference is known, count it, and add it up to the limit."""
    width = total.size
    low, high = max(-shift, 0), min(width - shift, width)
    if low >= high:
        return
    values, first, second = differences[low + shift : high + shift], one[low:high], other[low:high]
    number, amount = compared[low:high], total[low:high]
    for x in range(values.size):
        counts = first[x] & second[x] & np.int32(values[x] != UNKNOWN)
        number[x] += counts
        amount[x] += counts * min(np.int32(values[x]), np.int32(limit))
