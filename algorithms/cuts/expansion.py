"""Expansion moves for one view (Boykov, Veksler & Zabih 2001): labels of least cost and least change.

Y. Boykov, O. Veksler, R. Zabih, "Fast approximate energy minimization via graph cuts", IEEE PAMI 23(11), 2001.
"""

from collections.abc import Callable
from math import floor, log2

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.cuts.contraction import contract
from matbench.algorithms.cuts.maxflow import Flow, minimum_cut
from matbench.algorithms.cuts.network import Network
from matbench.algorithms.kernels import helper, kernel

FINEST = 16  # bits: the largest cost is at most 2 to this power, so that what flows through a node fits into 32
BLOCK = 2

Labels = NDArray[np.int32]
Weights = tuple[NDArray[np.float32], NDArray[np.float32]]
Tell = Callable[[int, float, Labels], None]


@frozen(eq=False)
class Expanded:
    """Labels that no expansion moves, or those after the last round.

    Parameters
    ----------
    labels
        (H, W) int32 planes; (H, views, W) of several views.
    energies
        The energy of the first labels, and that after each round; mean over the pixels, in the cost's unit.
    expansions
        How many moves were tried: minimal cuts.
    arcs
        Pairs of nodes that were linked in all of them together. A node is a pixel, or several that move together.
    """

    labels: Labels
    energies: tuple[float, ...]
    expansions: int
    arcs: int


def contrast_weights(image: NDArray[np.uint8], strength: float, factor: float, threshold: float) -> Weights:
    """What neighbours of different labels pay: `strength`, and `factor` times that where the view is flat.

    It is flat between two pixels if their colours differ by less than `threshold` grey levels (the largest
    difference over the colours).

    Returns
    -------
    (H - 1, W) weights to the pixel below, and (H, W - 1) to that on the right, both float32.
    """

    def weights(axis: int) -> NDArray[np.float32]:
        steps = np.abs(np.diff(image.astype(np.int16), axis=axis)).max(axis=2)
        return np.where(steps < threshold, strength * factor, strength).astype(np.float32)

    return weights(0), weights(1)


def whole(largest: float) -> float:
    """Units of energy per unit of cost, a power of two: costs become whole numbers, the largest a little below 2^16."""
    return 2.0 ** (FINEST - 1 - floor(log2(largest))) if largest > 0 else 1.0


def label_order(planes: int, seed: int) -> NDArray[np.int64]:
    """The order in which labels expand, the same for the same seed: 0 from far to near, else at random."""
    return np.random.default_rng(seed).permutation(planes) if seed else np.arange(planes)


def expand_from(
    labels: Labels,
    planes: int,
    most_links: int,
    energy: Callable[[Labels], int],
    link: Callable[[Labels, int, NDArray[np.int32], NDArray[np.int32]], int],
    mean: Callable[[int], float],
    rounds: int,
    seed: int = 0,
    flow: Flow = "trees",
    threads: int = 1,
    tell: Tell | None = None,
    bound: bool = False,
) -> Expanded:
    """Labels that lower the energy, by expansions.

    In each round every label expands once: all pixels keep their label or take the expanding one, whatever is best for
    all of them together, which is a minimal cut. A move is accepted only if the energy falls. Nothing depends on `flow`
    and `threads`.

    Parameters
    ----------
    labels
        int32 planes to start from; the first axis is that of the rows.
    most_links
        How many links a network has at most.
    energy
        Labels -> their energy in whole units.
    link
        Called with labels, the expanding one, (pixels,) `excess` and (4, most_links) `links`, both int32, to be
        overwritten with the network of the expansion (see `link_pixels`); returns its number of links.
    mean
        An energy in whole units -> the mean over the pixels, in the cost's unit.
    rounds
        At most how many; it ends when no label's expansion lowers the energy.
    seed
        See `label_order`.
    flow
        See `minimum_cut`.
    tell
        Is told each round's number, and the energy and the labels after it.
    bound
        Do some pixels only move together? They are one node then (`contract`).
    """
    now = energy(labels)
    energies, expansions, arcs, idle = [mean(now)], 0, 0, 0
    excess, links = np.empty(labels.size, np.int32), np.empty((4, most_links), np.int32)
    order, blocks = label_order(planes, seed), max(1, len(labels) // BLOCK) if threads > 1 else 1
    member: NDArray[np.int32] | slice = slice(None)
    for number in range(rounds):
        for alpha in order:
            count = link(labels, alpha, excess, links)
            needed = links[:, :count]
            if bound:
                member, left, needed = contract(excess, needed)
                network = Network.of(left, *needed)
            else:
                network = Network.of(excess, *needed)
            cut = minimum_cut(network, flow, threads, blocks)
            expansions, arcs, gain = expansions + 1, arcs + network.arcs, network.taken - cut.flow
            idle = 0 if gain else idle + 1
            if gain:
                keeps = cut.sources[member].reshape(labels.shape)
                labels, now = np.where(keeps, labels, np.int32(alpha)), now - gain
            if idle == planes:
                break
        energies.append(mean(now))
        if tell is not None:
            tell(number, energies[-1], labels)
        if idle == planes:
            break
    return Expanded(labels, tuple(energies), expansions, arcs)


def expand(
    cost: NDArray[np.float32],
    weights: Weights,
    truncation: int = 1,
    rounds: int = 3,
    seed: int = 0,
    flow: Flow = "trees",
    threads: int = 1,
) -> Expanded:
    """Labels f that lower E = sum over pixels of cost(p, f_p) + sum over neighbours of w min(|f_p - f_q|, T).

    They start at the least costs (`expand_from`). All energies are whole numbers.

    Parameters
    ----------
    cost
        (H, planes, W) float32, finite.
    weights
        (H - 1, W) and (H, W - 1), not negative; see `contrast_weights`.
    truncation
        T; 1 is the model of Potts.
    rounds, seed, flow
        As for `expand_from`.
    """
    least = cost.min(axis=1, keepdims=True)
    largest = max(float((cost - least).max()), *(float(part.max(initial=0)) * truncation for part in weights))
    scale = whole(largest)
    units = np.rint((cost - least) * np.float32(scale)).astype(np.int32)
    down, right = (np.rint(part * np.float32(scale)).astype(np.int32) for part in weights)
    base = float(least.sum(dtype=np.float64))
    labels = np.ascontiguousarray(units.argmin(axis=1), np.int32)

    return expand_from(
        labels, cost.shape[1], 2 * labels.size,
        lambda labels: int(energy_of(labels, units, down, right, truncation)),
        lambda labels, *rest: int(link_pixels(labels, units, down, right, truncation, *rest)),
        lambda energy: (base + energy / scale) / labels.size,
        rounds, seed, flow, threads,
    )  # fmt: skip


@helper
def _change(f, g, truncation):  # type: ignore[no-untyped-def]
    """V = min(|f - g|, T)."""
    return min(abs(f - g), truncation)


@kernel
def energy_of(labels, units, down, right, truncation):  # type: ignore[no-untyped-def]
    """The energy of (H, W) labels in whole units."""
    height, width = labels.shape
    energy = np.int64(0)
    for y in range(height):
        for x in range(width):
            f = labels[y, x]
            energy += units[y, f, x]
            if y + 1 < height:
                energy += np.int64(down[y, x]) * _change(f, labels[y + 1, x], truncation)
            if x + 1 < width:
                energy += np.int64(right[y, x]) * _change(f, labels[y, x + 1], truncation)
    return energy


@helper
def tie(p, q, f, g, alpha, weight, truncation, count, excess, links):  # type: ignore[no-untyped-def]
    """Add what neighbours pay; returns the number of links so far.

    With x = 1 for a pixel that takes alpha, they pay E00 = V(f, g), E01 = V(f, alpha), E10 = V(alpha, g), E11 = 0,
    that is E00 + (E10 - E00) x_p - E10 x_q + (E01 + E10 - E00) (1 - x_p) x_q.
    """
    both, first, second = (
        weight * _change(f, g, truncation),
        weight * _change(f, alpha, truncation),
        weight * _change(alpha, g, truncation),
    )
    excess[p] += second - both
    excess[q] -= second
    capacity = first + second - both
    if capacity > 0:
        links[0, count], links[1, count], links[2, count], links[3, count] = p, q, capacity, 0
        return count + 1
    return count


@kernel
def link_pixels(labels, units, down, right, truncation, alpha, excess, links):  # type: ignore[no-untyped-def]
    """The network of one expansion; returns its number of links.

    A pixel on the sink's side takes alpha.

    Parameters
    ----------
    labels, units, down, right
        (H, W), (H, planes, W), (H - 1, W) and (H, W - 1) int32.
    excess
        (H W,), overwritten.
    links
        (4, 2 H W): tails, heads, and capacities in both directions; overwritten.
    """
    height, width = labels.shape
    for y in range(height):
        for x in range(width):
            excess[y * width + x] = units[y, alpha, x] - units[y, labels[y, x], x]
    count = 0
    for y in range(height):
        for x in range(width):
            p, f = y * width + x, labels[y, x]
            if x + 1 < width:
                count = tie(p, p + 1, f, labels[y, x + 1], alpha, right[y, x], truncation, count, excess, links)
            if y + 1 < height:
                count = tie(p, p + width, f, labels[y + 1, x], alpha, down[y, x], truncation, count, excess, links)
    return count
