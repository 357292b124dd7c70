"""Minimal cuts by any of three libraries; the flow and the cut are the same by each."""

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from matbench.algorithms.cuts.boykov_kolmogorov import FREE, push_flow
from matbench.algorithms.cuts.handing_on import hand_on
from matbench.algorithms.cuts.network import Network

Flow = Literal["trees", "scipy", "ortools"]
SWEEPS = 4  # of `hand_on` at most, before trees grow


@frozen(eq=False)
class Cut:
    """A minimal cut of a network.

    Parameters
    ----------
    flow
        Its capacity, and the value of the maximal flow.
    sources
        (nodes,) bool: the nodes on the side of the source. Of all minimal cuts the one with the smallest such
        side, so that it does not depend on how the flow was found.
    """

    flow: int
    sources: NDArray[np.bool_]


def minimum_cut(network: Network, by: Flow = "trees", threads: int = 1, blocks: int = 1) -> Cut:
    """The minimal cut with the smallest source side.

    Parameters
    ----------
    by
        ``trees``: `push_flow`; ``scipy``: Dinic's algorithm of scipy; ``ortools``: OR-Tools, to be installed.
    threads, blocks
        With ``trees``, flows are first found within so many blocks of consecutive nodes, several at once.
    """
    if by == "trees":
        return _by_trees(network, threads, blocks)
    return _LIBRARIES[by](network)


def _by_trees(network: Network, threads: int, blocks: int) -> Cut:
    nodes = network.excess.size
    capacity, excess = network.capacity.copy(), network.excess.copy()
    hand_on(network.start, network.head, network.sister, capacity, excess, SWEEPS)
    parent, stamp, depth, queue, orphans = (np.empty(nodes, np.int32) for _ in range(5))
    is_sink, waiting = np.empty(nodes, bool), np.empty(nodes, bool)

    def push(low: int, high: int) -> int:
        return int(
            push_flow(
                network.start, network.head, network.sister, capacity, excess,
                parent, is_sink, stamp, depth, waiting, queue, orphans, low, high,
            )
        )  # fmt: skip

    # what flowed already: all cuts cost less by it, also the one around the sink
    value = network.taken - evolve(network, excess=excess).taken
    bounds = [nodes * block // blocks for block in range(blocks + 1)]
    if blocks > 1:
        with ThreadPoolExecutor(max(1, threads)) as pool:
            value += sum(pool.map(push, bounds[:-1], bounds[1:]))
    value += push(0, nodes)
    return Cut(value, (parent != FREE) & ~is_sink)


def _listed(network: Network) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Tails, heads and capacities of all arcs, those from the source and to the sink among them.

    The source is the node after the last, the sink the next one.
    """
    nodes = network.excess.size
    tails = np.repeat(np.arange(nodes, dtype=np.int32), np.diff(network.start))
    giving, taking = np.flatnonzero(network.excess > 0), np.flatnonzero(network.excess < 0)
    return (
        np.concatenate([tails, np.full(giving.size, nodes), taking], dtype=np.int32),
        np.concatenate([network.head, giving, np.full(taking.size, nodes + 1)], dtype=np.int32),
        np.concatenate([network.capacity, network.excess[giving], -network.excess[taking]], dtype=np.int32),
    )


def _by_scipy(network: Network) -> Cut:
    nodes = network.excess.size
    tails, heads, capacity = _listed(network)
    graph = coo_array((capacity, (tails, heads)), shape=(nodes + 2, nodes + 2)).tocsr()
    flow = maximum_flow(graph, nodes, nodes + 1, method="dinic").flow
    left = csr_array(graph - flow)
    left.eliminate_zeros()
    reached = breadth_first_order(left, nodes, return_predecessors=False)
    sources = np.zeros(nodes + 2, bool)
    sources[reached] = True
    # summed here: the library adds in 32 bits
    return Cut(int(flow[[nodes]].sum(dtype=np.int64)), sources[:nodes])


def _by_ortools(network: Network) -> Cut:
    from ortools.graph.python.max_flow import SimpleMaxFlow

    nodes = network.excess.size
    solver = SimpleMaxFlow()
    solver.add_arc_with_capacity(nodes, nodes + 1, 0)  # it must know both ends, even if nothing leads there
    solver.add_arcs_with_capacity(*_listed(network))
    status = solver.solve(nodes, nodes + 1)
    if status != SimpleMaxFlow.OPTIMAL:
        raise RuntimeError(f"OR-Tools found no maximal flow: {status}")
    sources = np.zeros(nodes + 2, bool)
    sources[solver.get_source_side_min_cut()] = True
    return Cut(int(solver.optimal_flow()), sources[:nodes])


_LIBRARIES: Mapping[str, Callable[[Network], Cut]] = {"scipy": _by_scipy, "ortools": _by_ortools}
