"""Cuts by every library: equal flows, equal sides."""

import importlib.util

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import networks

from matbench.algorithms.cuts.maxflow import minimum_cut

LIBRARIES = ["scipy", *(["ortools"] if importlib.util.find_spec("ortools") else [])]


@pytest.mark.parametrize("by", LIBRARIES)
@settings(deadline=None)
@given(network=networks(40))
def test_flows_and_cuts_are_the_same_by_every_library(by, network):
    ours, theirs = minimum_cut(network), minimum_cut(network, by)
    assert ours.flow == theirs.flow == network.value(ours.sources)
    assert (ours.sources == theirs.sources).all()


@settings(deadline=None)
@given(networks(40), st.integers(1, 3), st.integers(1, 50))
def test_neither_threads_nor_blocks_change_a_cut(network, threads, blocks):
    whole, parts = minimum_cut(network), minimum_cut(network, "trees", threads, blocks)
    assert whole.flow == parts.flow
    assert (whole.sources == parts.sources).all()


@settings(deadline=None)
@given(networks(20))
def test_a_cut_leaves_the_network_as_it_is(network):
    before = network.capacity.copy(), network.excess.copy()
    minimum_cut(network, "trees", 2, 3)
    assert np.array_equal(before[0], network.capacity)
    assert np.array_equal(before[1], network.excess)
