"""A network between a source and a sink: the graph that a maximal flow is sought in."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel

# the capacity of an arc that no minimal cut contains: more than flows through any node, and twice it fits into 32 bits
UNLIMITED = 1 << 29


@frozen(eq=False)
class Network:
    """Nodes, the arcs between them, and what the source and the sink give to each node.

    Arcs are sorted by the node that they leave. Each has a sister, the same arc in the other direction.

    Parameters
    ----------
    start
        (nodes + 1,) int32: the arcs of node u are ``start[u] : start[u + 1]``.
    head
        (arcs,) int32, the node that an arc leads to.
    sister
        (arcs,) int32.
    capacity
        (arcs,) int32, 0 if the arc exists for its sister alone.
    excess
        (nodes,) int32. Capacity from the source if positive; that to the sink, negated, if negative.
    """

    start: NDArray[np.int32]
    head: NDArray[np.int32]
    sister: NDArray[np.int32]
    capacity: NDArray[np.int32]
    excess: NDArray[np.int32]

    @classmethod
    def of(
        cls,
        excess: NDArray[np.int32],
        tails: NDArray[np.int32],
        heads: NDArray[np.int32],
        forth: NDArray[np.int32],
        back: NDArray[np.int32],
    ) -> "Network":
        """The network of pairs of nodes (tail, head) with the capacities in both directions."""
        start = np.zeros(excess.size + 1, np.int32)
        head, sister, capacity = (np.empty(2 * tails.size, np.int32) for _ in range(3))
        link(tails, heads, forth, back, start, head, sister, capacity)
        return cls(start, head, sister, capacity, excess)

    @property
    def arcs(self) -> int:
        """Pairs of nodes that are linked."""
        return self.head.size // 2

    @property
    def taken(self) -> int:
        """What the sink takes of all nodes together at most: the capacity of the cut around it."""
        return -int(np.minimum(self.excess, 0).sum(dtype=np.int64))

    def value(self, sources: NDArray[np.bool_]) -> int:
        """The capacity of a cut: of all arcs that leave the source side."""
        tails = np.repeat(np.arange(self.excess.size), np.diff(self.start))
        crossing = sources[tails] & ~sources[self.head]
        ends = np.where(sources, -np.minimum(self.excess, 0), np.maximum(self.excess, 0))
        return int(self.capacity[crossing].sum(dtype=np.int64) + ends.sum(dtype=np.int64))


@kernel
def link(tails, heads, forth, back, start, head, sister, capacity):  # type: ignore[no-untyped-def]
    """Sort pairs of nodes into the arrays of `Network`: all (arcs,) but `start`, which is 0 at first."""
    for k in range(tails.size):
        start[tails[k] + 1] += 1
        start[heads[k] + 1] += 1
    for u in range(start.size - 1):
        start[u + 1] += start[u]
    place = start[:-1].copy()
    for k in range(tails.size):
        u, v = tails[k], heads[k]
        a, b = place[u], place[v]
        place[u] += 1
        place[v] += 1
        head[a], capacity[a], sister[a] = v, forth[k], b
        head[b], capacity[b], sister[b] = u, back[k], a
