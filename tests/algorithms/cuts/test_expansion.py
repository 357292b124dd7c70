"""Expansion moves against every possible move on small problems."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.cuts.expansion import (
    contrast_weights,
    energy_of,
    expand,
    label_order,
    link_pixels,
    whole,
)
from matbench.algorithms.cuts.maxflow import minimum_cut
from matbench.algorithms.cuts.network import Network


def twin(labels, units, down, right, truncation):
    """The energy, pixel by pixel."""
    height, width = labels.shape
    paid = sum(int(units[y, labels[y, x], x]) for y, x in np.ndindex(height, width))
    for y, x in np.ndindex(down.shape):
        paid += int(down[y, x]) * min(abs(int(labels[y, x]) - int(labels[y + 1, x])), truncation)
    for y, x in np.ndindex(right.shape):
        paid += int(right[y, x]) * min(abs(int(labels[y, x]) - int(labels[y, x + 1])), truncation)
    return paid


@st.composite
def problems(draw):
    height, width, planes = draw(st.integers(1, 3)), draw(st.integers(1, 3)), draw(st.integers(1, 4))
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    units = rng.integers(0, 20, (height, planes, width)).astype(np.int32)
    down = rng.integers(0, 12, (height - 1, width)).astype(np.int32)
    right = rng.integers(0, 12, (height, width - 1)).astype(np.int32)
    labels = rng.integers(0, planes, (height, width)).astype(np.int32)
    return labels, units, down, right, draw(st.integers(1, 3))


@settings(deadline=None)
@given(problems())
def test_every_move_is_the_best_of_all_possible_ones(problem):
    labels, units, down, right, truncation = problem
    assert energy_of(labels, units, down, right, truncation) == twin(labels, units, down, right, truncation)
    for alpha in range(units.shape[1]):
        excess, links = np.empty(labels.size, np.int32), np.empty((4, 2 * labels.size), np.int32)
        count = link_pixels(labels, units, down, right, truncation, alpha, excess, links)
        cut = minimum_cut(Network.of(excess, *links[:, :count]))
        found = np.where(cut.sources.reshape(labels.shape), labels, alpha)
        takes = (np.array(chosen).reshape(labels.shape) for chosen in product((False, True), repeat=labels.size))
        moves = [np.where(taken, alpha, labels) for taken in takes]
        assert twin(found, *problem[1:]) == min(twin(move, *problem[1:]) for move in moves)


@settings(max_examples=40, deadline=None)
@given(problems(), st.integers(0, 3), st.integers(1, 4))
def test_the_energy_never_rises_and_no_move_lowers_what_is_found(problem, seed, rounds):
    _, units, down, right, truncation = problem
    cost, weights = units.astype(np.float32), (down.astype(np.float32), right.astype(np.float32))
    found = expand(cost, weights, truncation, rounds, seed)
    assert list(found.energies) == sorted(found.energies, reverse=True)
    assert found.energies[-1] * found.labels.size == pytest.approx(twin(found.labels, *problem[1:]), abs=1e-3)
    assert len(found.energies) <= 1 + rounds
    settled = expand(cost, weights, truncation, 50, seed)
    best = twin(settled.labels, *problem[1:])
    for alpha in range(units.shape[1]):
        for chosen in product((False, True), repeat=settled.labels.size):
            taken = np.array(chosen).reshape(settled.labels.shape)
            assert twin(np.where(taken, alpha, settled.labels), *problem[1:]) >= best


def test_labels_depend_on_neither_library_nor_threads_nor_blocks(monkeypatch):
    rng = np.random.default_rng(3)
    cost = rng.random((40, 5, 30), np.float32)
    weights = contrast_weights(rng.integers(0, 30, (40, 30, 3), np.uint8), 0.2, 2.0, 8.0)
    found = expand(cost, weights)
    for flow, threads in (("trees", 3), ("scipy", 1)):
        again = expand(cost, weights, flow=flow, threads=threads)
        assert (again.labels == found.labels).all()
        assert again.energies == found.energies
    monkeypatch.setattr("matbench.algorithms.cuts.expansion.BLOCK", 7)
    assert (expand(cost, weights).labels == found.labels).all()


def test_two_labels_end_at_the_least_energy_of_all():
    rng = np.random.default_rng(5)
    cost = rng.random((3, 2, 4), np.float32)
    weights = (np.full((2, 4), 0.3, np.float32), np.full((3, 3), 0.3, np.float32))
    found = expand(cost, weights, rounds=10)

    def paid(labels):
        own = np.take_along_axis(cost, labels[:, None], 1).sum()
        return own + 0.3 * ((np.diff(labels, axis=0) != 0).sum() + (np.diff(labels, axis=1) != 0).sum())

    every = (np.array(chosen).reshape(3, 4) for chosen in product((0, 1), repeat=12))
    assert paid(found.labels) == pytest.approx(min(map(paid, every)), abs=1e-4)
    assert found.energies[-1] * 12 == pytest.approx(paid(found.labels), abs=1e-3)


def test_what_is_flat_holds_together_more():
    image = np.zeros((2, 3, 3), np.uint8)
    image[1, 2, 1] = 8
    down, right = contrast_weights(image, 0.5, 3.0, 8.0)
    assert down.tolist() == [[1.5, 1.5, 0.5]]
    assert right.tolist() == [[1.5, 1.5], [1.5, 0.5]]


@given(st.floats(1e-6, 1e6))
def test_units_are_fine_and_fit(largest):
    assert 2**15 <= largest * whole(largest) < 2**16
    assert whole(0) == 1


def test_the_order_of_labels_is_that_of_the_seed():
    assert label_order(6, 0).tolist() == [0, 1, 2, 3, 4, 5]
    assert label_order(6, 1).tolist() == label_order(6, 1).tolist() != label_order(6, 2).tolist()
    assert sorted(label_order(6, 1)) == [0, 1, 2, 3, 4, 5]
