"""Networks: arcs sorted by node, and what a cut costs."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import networks

from matbench.algorithms.cuts.network import UNLIMITED, Network


def test_a_network_holds_the_arcs_that_it_is_made_of():
    tails, heads, forth, back = np.array([[2, 0, 1, 0], [0, 1, 2, 1], [5, 6, 7, 8], [0, 1, 2, 3]], np.int32)
    made = Network.of(np.array([3, 0, -4], np.int32), tails, heads, forth, back)
    assert made.arcs == 4
    owner = np.repeat(np.arange(3), np.diff(made.start))
    found = sorted(zip(owner.tolist(), made.head.tolist(), made.capacity.tolist(), strict=True))
    both = [*zip(tails, heads, forth, strict=True), *zip(heads, tails, back, strict=True)]
    assert found == sorted(tuple(map(int, arc)) for arc in both)


@settings(deadline=None)
@given(networks(), st.integers(0, 2**12 - 1))
def test_sisters_are_the_same_arc_seen_from_its_other_end(network, side):
    owner = np.repeat(np.arange(network.excess.size), np.diff(network.start))
    assert (network.sister[network.sister] == np.arange(network.head.size)).all()
    assert (owner[network.sister] == network.head).all()
    sources = (side >> np.arange(network.excess.size)) & 1 > 0
    paid = sum(int(c) for u, v, c in zip(owner, network.head, network.capacity, strict=True) if sources[u] > sources[v])
    paid += sum(max(0, -int(e)) if keeps else max(0, int(e)) for e, keeps in zip(network.excess, sources, strict=True))
    assert network.value(sources) == paid


def test_twice_an_unlimited_capacity_fits_into_its_type():
    assert np.iinfo(np.int32).max > 2 * UNLIMITED
