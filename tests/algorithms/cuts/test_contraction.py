"""Nodes that no minimal cut parts become one: the cuts stay what they are."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.cuts.contraction import contract
from matbench.algorithms.cuts.maxflow import minimum_cut
from matbench.algorithms.cuts.network import UNLIMITED, Network


@st.composite
def problems(draw):
    """Excesses and links, many of which are unlimited in one direction or both."""
    nodes = draw(st.integers(2, 8))
    rng = np.random.default_rng(draw(st.integers(0, 99999)))
    tails = rng.integers(0, nodes, draw(st.integers(0, 20)))
    heads = (tails + rng.integers(1, nodes, tails.size)) % nodes
    capacities = rng.integers(0, 9, (2, tails.size)) + UNLIMITED * (rng.random((2, tails.size)) < 0.4)
    return rng.integers(-20, 21, nodes).astype(np.int32), np.stack([tails, heads, *capacities]).astype(np.int32)


def joined(nodes, links):
    """The sets of nodes that unlimited links of both directions hold together, by merging sets one by one."""
    sets = [{u} for u in range(nodes)]
    for tail, head, forth, back in links.T.tolist():
        if min(forth, back) >= UNLIMITED:
            one, other = (next(part for part in sets if u in part) for u in (tail, head))
            if one is not other:
                sets.remove(other)
                one |= other
    return sorted(sets, key=min)


@settings(deadline=None)
@given(problems())
def test_nodes_are_united_and_their_links_add_up(problem):
    excess, links = problem
    member, left, fewer = contract(excess, links.copy())
    sets = joined(excess.size, links)
    assert [set(np.flatnonzero(member == place).tolist()) for place in range(left.size)] == sets
    assert left.tolist() == [sum(int(excess[u]) for u in part) for part in sets]
    assert (fewer[0] < fewer[1]).all()
    assert len({(u, v) for u, v in fewer[:2].T.tolist()}) == fewer.shape[1]
    found = {(u, v): (forth, back) for u, v, forth, back in fewer.T.tolist()}
    wanted = {}
    for tail, head, forth, back in links.T.tolist():
        u, v = int(member[tail]), int(member[head])
        if u != v:
            pair, two = ((u, v), (forth, back)) if u < v else ((v, u), (back, forth))
            wanted[pair] = tuple(min(UNLIMITED, a + b) for a, b in zip(wanted.get(pair, (0, 0)), two, strict=True))
    assert found == wanted


@settings(max_examples=50, deadline=None)
@given(problems())
def test_the_cut_is_the_smallest_of_all_of_the_whole_network(problem):
    excess, links = problem
    whole, nodes = Network.of(excess, *links), excess.size
    sides = [(number >> np.arange(nodes)) & 1 > 0 for number in range(2**nodes)]
    costs = [whole.value(side) for side in sides]
    member, left, fewer = contract(excess, links.copy())
    cut = minimum_cut(Network.of(left, *fewer))
    best = [side for side, cost in zip(sides, costs, strict=True) if cost == min(costs)]
    assert (cut.sources[member] == np.logical_and.reduce(best)).all()
    # what flows from the source to the sink of the same node is no flow between nodes
    united = np.maximum(excess, 0).sum() - np.maximum(left, 0).sum()
    assert cut.flow + united == min(costs)
