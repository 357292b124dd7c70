"""Flows by search trees: as much as the smallest of all cuts, kept at every node, within blocks of nodes too."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import networks

from matbench.algorithms.cuts.boykov_kolmogorov import FREE, push_flow


def pushed(network, low, high):
    """Value of the flow between nodes low..high, what it leaves of capacities and excesses, and its source side."""
    nodes, left = network.excess.size, (network.capacity.copy(), network.excess.copy())
    spaces = [np.full(nodes, 77, kind) for kind in (np.int32, bool, np.int32, np.int32, bool, np.int32, np.int32)]
    value = push_flow(network.start, network.head, network.sister, *left, *spaces, low, high)
    return value, *left, (spaces[0] != FREE) & ~spaces[1]


@settings(deadline=None)
@given(networks(8))
def test_the_flow_is_the_smallest_of_all_cuts_and_the_side_the_smallest_of_its_cuts(network):
    value, _, _, found = pushed(network, 0, network.excess.size)
    nodes = network.excess.size
    sides = [(number >> np.arange(nodes)) & 1 > 0 for number in range(2**nodes)]
    costs = [network.value(side) for side in sides]
    assert value == min(costs)
    best = [side for side, cost in zip(sides, costs, strict=True) if cost == value]
    assert (found == np.logical_and.reduce(best)).all()


@settings(deadline=None)
@given(networks(), st.integers(0, 12), st.integers(0, 12))
def test_a_flow_is_kept_at_every_node_and_stays_within_its_block(network, one, other):
    nodes = network.excess.size
    low, high = sorted((min(one, nodes), min(other, nodes)))
    value, capacity, excess, _ = pushed(network, low, high)
    owner = np.repeat(np.arange(nodes), np.diff(network.start))
    flow = network.capacity - capacity
    assert (capacity >= 0).all()
    assert (flow == -flow[network.sister]).all()
    net = np.bincount(owner, flow, nodes)
    assert (net == network.excess - excess).all()
    assert (excess * network.excess >= 0).all(), "no more is taken than is there"
    assert value == np.maximum(network.excess, 0).sum() - np.maximum(excess, 0).sum()
    inside = (owner >= low) & (owner < high) & (network.head >= low) & (network.head < high)
    assert not flow[~inside].any()
