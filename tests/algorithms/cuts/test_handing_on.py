"""What is handed on changes no minimal cut, and no node holds more than fits."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import networks

from matbench.algorithms.cuts.handing_on import MOST, hand_on
from matbench.algorithms.cuts.network import UNLIMITED, Network


def handed(network, sweeps):
    """A network after so many sweeps."""
    capacity, excess = network.capacity.copy(), network.excess.copy()
    hand_on(network.start, network.head, network.sister, capacity, excess, sweeps)
    return Network(network.start, network.head, network.sister, capacity, excess)


def twin(network, sweeps):
    """The same, with Python's numbers and one dictionary of capacities for each arc."""
    excess, nodes = network.excess.tolist(), network.excess.size
    capacity = dict(enumerate(network.capacity.tolist()))
    for sweep in range(2 * sweeps):
        order = range(nodes) if sweep % 2 == 0 else reversed(range(nodes))
        for u in order:
            for a in range(network.start[u], network.start[u + 1]):
                v, back = int(network.head[a]), int(network.sister[a])
                if (v > u) == (sweep % 2 == 0):
                    given = min(excess[u], capacity[a]) if excess[u] > 0 else max(excess[u], -capacity[back])
                    capacity[a], capacity[back] = capacity[a] - given, capacity[back] + given
                    excess[u], excess[v] = excess[u] - given, excess[v] + given
        if not min(excess) < 0 < max(excess):
            break
    return excess, [capacity[a] for a in range(len(capacity))]


@settings(deadline=None)
@given(networks(12), st.integers(0, 3))
def test_as_much_is_handed_on_as_arcs_carry(network, sweeps):
    excess, capacity = twin(network, sweeps)
    found = handed(network, sweeps)
    assert found.excess.tolist() == excess
    assert found.capacity.tolist() == capacity


@settings(deadline=None)
@given(networks(7), st.integers(1, 3))
def test_all_cuts_cost_less_by_what_has_flowed(network, sweeps):
    found, nodes = handed(network, sweeps), network.excess.size
    sides = [(number >> np.arange(nodes)) & 1 > 0 for number in range(2**nodes)]
    flowed = network.taken - found.taken
    assert [network.value(side) - found.value(side) for side in sides] == [flowed] * len(sides)


def test_a_chain_is_solved_by_one_sweep():
    excess = np.array([5, -3, -4, 9, 0, -8], np.int32)
    carries = np.array([4, 2, 9, 9, 3], np.int32)
    tails = np.arange(5, dtype=np.int32)
    chain = Network.of(excess, tails, tails + 1, carries, carries)
    found = handed(chain, 1)
    least = min(chain.value((number >> np.arange(6)) & 1 > 0) for number in range(64))
    assert chain.taken - found.taken == least


def test_no_node_holds_more_than_fits():
    excess = np.full(9, UNLIMITED - 1, np.int32)
    excess[-1] = -1
    tails = np.arange(8, dtype=np.int32)
    much = np.full(8, UNLIMITED, np.int32)
    star = Network.of(excess, tails, np.full(8, 8, np.int32), much, much)
    for network in (star, Network.of(-excess, tails, np.full(8, 8, np.int32), much, much)):
        found = handed(network, 4)
        assert np.abs(found.excess.astype(np.int64)).max() <= MOST
        assert found.excess.sum(dtype=np.int64) == network.excess.sum(dtype=np.int64)
        assert (found.capacity >= 0).all()


@settings(deadline=None)
@given(networks(12))
def test_it_ends_when_nothing_lacks_or_nothing_has(network):
    states = [handed(network, sweeps) for sweeps in range(1, 6)]
    for one, other in pairwise(states):
        if not (one.excess.min(initial=0) < 0 < one.excess.max(initial=0)):
            assert (one.excess == other.excess).all()
            assert (one.capacity == other.capacity).all()
