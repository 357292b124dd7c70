"""Expansion moves for all views at once, in which no view sees through the surface of another.

V. Kolmogorov, R. Zabih, "Multi-camera scene reconstruction via graph cuts", ECCV 2002.
"""

from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.cuts.expansion import Expanded, Tell, expand_from, tie
from matbench.algorithms.cuts.maxflow import Flow
from matbench.algorithms.cuts.network import UNLIMITED
from matbench.algorithms.kernels import helper, kernel
from matbench.space import DisparitySpace, Volume, surface


@frozen(eq=False)
class Lattice:
    """The pixels of all views, their homologues, and what labels cost, in whole units.

    Parameters
    ----------
    pairs
        (pairs, 2) views that interact, the left one first.
    shifts
        (pairs, planes) int64: pixel x of the left view has its homologue at ``x + shift`` of the right one, and that
        one's is x again. See `whole_shifts`.
    agreeing
        (pairs, H, planes, W) int16, never positive: what two homologous pixels earn if both have the label of
        their plane, at the pixels of the left view; (0, 0, 0, 0) if nothing.
    alone
        (H, views, planes, W) int32: what a pixel's label costs by itself; (0, 0, 0, 0) if nothing.
    down, right
        (views, H - 1, W) and (views, H, W - 1) int32, what neighbours pay; see `expand`.
    truncation
        T of the same place.
    scale
        Units of energy in one unit of cost.
    """

    pairs: NDArray[np.int64]
    shifts: NDArray[np.int64]
    agreeing: NDArray[np.int16]
    alone: NDArray[np.int32]
    down: NDArray[np.int32]
    right: NDArray[np.int32]
    truncation: int
    scale: float

    @property
    def labels(self) -> NDArray[np.int32]:
        """(H, views, W) labels at the start: all pixels in the farthest plane, so that nothing hides anything."""
        views, rows, between = self.right.shape
        return np.zeros((rows, views, between + 1), np.int32)

    @property
    def _terms(self) -> tuple[Any, ...]:
        return self.pairs, self.shifts, self.agreeing, self.alone, self.down, self.right, self.truncation

    def energy(self, labels: NDArray[np.int32]) -> float:
        """The energy per pixel of (H, views, W) labels, in the unit of the costs."""
        return self.mean(self.units(labels))

    def mean(self, energy: int) -> float:
        """An energy in whole units, per pixel and in the unit of the costs."""
        return energy / self.scale / self.labels.size

    def units(self, labels: NDArray[np.int32]) -> int:
        """The energy of labels, in whole units."""
        return int(lattice_energy(labels, *self._terms))

    def link(self, labels: NDArray[np.int32], alpha: int, excess: NDArray[np.int32], links: NDArray[np.int32]) -> int:
        """The network of one expansion, as `expand_from` wants it."""
        return int(link_views(labels, *self._terms, alpha, excess, links))

    def violations(self, labels: NDArray[np.int32]) -> int:
        """How many pixels another view sees through: their homologue in a pair of views has a farther label."""
        return int(count_violations(labels, self.pairs, self.shifts))


def whole_shifts(space: DisparitySpace, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    """(pairs, planes) by how many columns homologues lie apart, rounded to whole pixels.

    One number serves both ways, so that a pixel is the homologue of its homologue.
    """
    plane = np.arange(space.first, space.last + 1)
    steps = (pairs[:, 0] - pairs[:, 1])[:, None] * plane
    return np.asarray((2 * steps + space.fineness) // (2 * space.fineness), np.int64)


def disparities(space: DisparitySpace, labels: NDArray[np.int32]) -> NDArray[np.float32]:
    """(views, H, W) disparities of the labels' planes, in pixels per view step of the space."""
    return np.ascontiguousarray(space.disparities[labels].transpose(1, 0, 2))


def surfaces(space: DisparitySpace, maps: NDArray[np.float32], views: tuple[int, ...]) -> Volume:
    """The 0/1 volume of the maps of all views; a ray between two pixels ends where that of the nearest pixel does."""
    nearest = (np.arange(space.samples) + space.fineness // 2) // space.fineness
    return surface(space, {view: found[:, nearest] for view, found in enumerate(maps)}, views)


def expand_views(
    lattice: Lattice,
    labels: NDArray[np.int32],
    rounds: int,
    seed: int = 0,
    flow: Flow = "trees",
    threads: int = 1,
    tell: Tell | None = None,
) -> Expanded:
    """Labels of all views that lower the energy, from labels without violations to such labels.

    E = what the labels cost by themselves + what agreeing homologues earn + what neighbours pay, and infinity if a
    pixel's homologue has a farther label. Every label expands in all views together (`expand_from`).

    Parameters
    ----------
    labels
        (H, views, W) int32 to start from.
    rounds, seed, flow, tell
        As for `expand_from`.
    """
    rows, views, width = labels.shape
    most = rows * width * (2 * views + 3 * len(lattice.pairs))
    return expand_from(
        labels, lattice.shifts.shape[1], most, lattice.units, lattice.link, lattice.mean,
        rounds, seed, flow, threads, tell, bound=True,
    )  # fmt: skip


@kernel
def lattice_energy(labels, pairs, shifts, agreeing, alone, down, right, truncation):  # type: ignore[no-untyped-def]
    """The energy of labels without violations, in units."""
    rows, views, width = labels.shape
    energy = np.int64(0)
    for y in range(rows):
        for i in range(views):
            for x in range(width):
                f = labels[y, i, x]
                if alone.size > 0:
                    energy += alone[y, i, f, x]
                if y + 1 < rows:
                    energy += np.int64(down[i, y, x]) * min(abs(f - labels[y + 1, i, x]), truncation)
                if x + 1 < width:
                    energy += np.int64(right[i, y, x]) * min(abs(f - labels[y, i, x + 1]), truncation)
        for p in range(pairs.shape[0]):
            for x in range(width):
                f = labels[y, pairs[p, 0], x]
                at = x + shifts[p, f]
                if agreeing.size > 0 and 0 <= at < width and labels[y, pairs[p, 1], at] == f:
                    energy += agreeing[p, y, f, x]
    return energy


@kernel
def count_violations(labels, pairs, shifts):  # type: ignore[no-untyped-def]
    """How many times a pixel's homologue in a pair has a farther label than the pixel."""
    rows, _, width = labels.shape
    found = 0
    for y in range(rows):
        for p in range(pairs.shape[0]):
            for side in range(2):
                here, there = labels[y, pairs[p, side]], labels[y, pairs[p, 1 - side]]
                for x in range(width):
                    shift = shifts[p, here[x]]
                    at = x + shift if side == 0 else x - shift
                    if 0 <= at < width and there[at] < here[x]:
                        found += 1
    return found


@helper
def _join(p, q, forth, back, count, links):  # type: ignore[no-untyped-def]
    """Add a link; returns how many there are."""
    links[0, count], links[1, count], links[2, count], links[3, count] = p, q, forth, back
    return count + 1


@kernel
def link_views(labels, pairs, shifts, agreeing, alone, down, right, truncation, alpha, excess, links):  # type: ignore[no-untyped-def]
    """The network of one expansion of all views; returns its number of links.

    Nodes are pixels in the order of the labels; one on the sink's side takes alpha. With x = 1 for a pixel that takes
    alpha, a pair's table (E00, E01, E10, E11) is E00 + (E10 - E00) x_p + (E11 - E10) x_q
    + (E01 + E10 - E00 - E11) (1 - x_p) x_q. What is forbidden is kept out of it: it is an arc of unlimited capacity.

    Parameters
    ----------
    labels, pairs, shifts, agreeing, alone, down, right, truncation
        As in `Lattice`.
    excess
        (nodes,), overwritten.
    links
        (4, more than needed): tails, heads, and capacities in both directions; overwritten.
    """
    rows, views, width = labels.shape
    count = 0
    for y in range(rows):
        for i in range(views):
            for x in range(width):
                p = (y * views + i) * width + x
                excess[p] = alone[y, i, alpha, x] - alone[y, i, labels[y, i, x], x] if alone.size > 0 else 0
    for y in range(rows):
        for i in range(views):
            for x in range(width):
                p, f = (y * views + i) * width + x, labels[y, i, x]
                if x + 1 < width:
                    g, weight = labels[y, i, x + 1], right[i, y, x]
                    count = tie(p, p + 1, f, g, alpha, weight, truncation, count, excess, links)
                if y + 1 < rows:
                    g, weight = labels[y + 1, i, x], down[i, y, x]
                    count = tie(p, p + views * width, f, g, alpha, weight, truncation, count, excess, links)
        for pair in range(pairs.shape[0]):
            i, j = pairs[pair]
            first, second = (y * views + i) * width, (y * views + j) * width
            left, other = labels[y, i], labels[y, j]
            for x in range(width):
                f = left[x]
                at = x + shifts[pair, f]
                if f != alpha and 0 <= at < width:
                    barred = UNLIMITED if alpha < f else 0
                    if other[at] == f:  # both keep what they earn, or neither; if f is nearer, both or neither move
                        earned = -np.int32(agreeing[pair, y, f, x]) if agreeing.size > 0 else np.int32(0)
                        excess[first + x] += earned
                        if earned + barred > 0:
                            count = _join(first + x, second + at, earned + barred, barred, count, links)
                    elif barred > 0:  # would be seen through if it kept its label and its homologue moved
                        count = _join(first + x, second + at, barred, 0, count, links)
                g = other[x]
                at = x - shifts[pair, g]
                if alpha < g and 0 <= at < width and left[at] != g:
                    count = _join(second + x, first + at, UNLIMITED, 0, count, links)
                at = x + shifts[pair, alpha]
                if not 0 <= at < width:
                    continue
                g = other[at]
                earned = -np.int32(agreeing[pair, y, alpha, x]) if agreeing.size > 0 else np.int32(0)
                if f == alpha and g == alpha:
                    continue
                if f == alpha:
                    excess[second + at] -= earned
                elif g == alpha:
                    excess[first + x] -= earned
                else:
                    excess[second + at] -= earned
                    forth = earned + (UNLIMITED if f < alpha else 0)
                    back = UNLIMITED if g < alpha else 0
                    if forth + back > 0:
                        count = _join(first + x, second + at, forth, back, count, links)
    return count
