"""Moves of all views against every possible move on small problems, and what is never violated."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.cuts.lattice import Lattice, disparities, expand_views, link_views, surfaces, whole_shifts
from matbench.algorithms.cuts.maxflow import minimum_cut
from matbench.algorithms.cuts.network import Network
from matbench.algorithms.similarity import pairs as view_pairs
from matbench.space import DisparitySpace, visibility


def twin_violations(lattice, labels):
    """Pixels whose homologue in a pair has a farther label, one by one."""
    found = 0
    for p, (i, j) in enumerate(lattice.pairs):
        for here, there, sign in ((i, j, 1), (j, i, -1)):
            for y, x in np.ndindex(labels.shape[0], labels.shape[2]):
                at = x + sign * lattice.shifts[p, labels[y, here, x]]
                if 0 <= at < labels.shape[2]:
                    found += int(labels[y, there, at] < labels[y, here, x])
    return found


def twin(lattice, labels):
    """The energy, pixel by pixel; infinite if a view sees through another's surface."""
    if twin_violations(lattice, labels):
        return np.inf
    rows, views, width = labels.shape
    paid = 0
    for y, i, x in np.ndindex(rows, views, width):
        f = labels[y, i, x]
        paid += int(lattice.alone[y, i, f, x]) if lattice.alone.size else 0
        if y + 1 < rows:
            paid += int(lattice.down[i, y, x]) * min(abs(f - labels[y + 1, i, x]), lattice.truncation)
        if x + 1 < width:
            paid += int(lattice.right[i, y, x]) * min(abs(f - labels[y, i, x + 1]), lattice.truncation)
    for p, (i, j) in enumerate(lattice.pairs):
        for y, x in np.ndindex(rows, width):
            at = x + lattice.shifts[p, labels[y, i, x]]
            if 0 <= at < width and labels[y, j, at] == labels[y, i, x]:
                paid += int(lattice.agreeing[p, y, labels[y, i, x], x])
    return paid


@st.composite
def lattices(draw, rows=1, width=4, planes=3):
    rows, width, planes = draw(st.integers(1, rows)), draw(st.integers(1, width)), draw(st.integers(1, planes))
    views = draw(st.integers(2, 3))
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    first, fineness = draw(st.integers(-2, 2)), draw(st.integers(1, 2))
    space = DisparitySpace(views, rows, width, first, first + planes - 1, fineness)
    pairs = view_pairs(
        views, draw(st.sampled_from(["consecutive", "all", "reference"])), draw(st.integers(0, views - 1))
    )
    alone = rng.integers(0, 9, (rows, views, planes, width)) if draw(st.booleans()) else np.zeros((0, 0, 0, 0))
    return Lattice(
        pairs,
        whole_shifts(space, pairs),
        rng.integers(-20, 1, (len(pairs), rows, planes, width)).astype(np.int16),
        alone.astype(np.int32),
        rng.integers(0, 6, (views, rows - 1, width)).astype(np.int32),
        rng.integers(0, 6, (views, rows, width - 1)).astype(np.int32),
        draw(st.integers(1, 2)),
        8.0,
    )


def moves(labels, alpha):
    for chosen in product((False, True), repeat=labels.size):
        yield np.where(np.array(chosen).reshape(labels.shape), np.int32(alpha), labels)


@settings(max_examples=20, deadline=None)
@given(lattices(width=3))
def test_every_move_is_the_best_of_all_that_violate_nothing(lattice):
    labels = lattice.labels
    for alpha in [*range(lattice.shifts.shape[1])] * 2:
        excess, links = np.empty(labels.size, np.int32), np.empty((4, 200), np.int32)
        count = link_views(
            labels, lattice.pairs, lattice.shifts, lattice.agreeing, lattice.alone,
            lattice.down, lattice.right, lattice.truncation, alpha, excess, links,
        )  # fmt: skip
        cut = minimum_cut(Network.of(excess, *links[:, :count]))
        found = np.where(cut.sources.reshape(labels.shape), labels, np.int32(alpha))
        costs = [twin(lattice, move) for move in moves(labels, alpha)]
        assert twin(lattice, found) == min(costs)
        assert lattice.energy(found) * labels.size * lattice.scale == pytest.approx(min(costs))
        labels = found


@settings(max_examples=40, deadline=None)
@given(lattices(rows=3, width=9, planes=6), st.integers(0, 3), st.integers(1, 3))
def test_the_energy_never_rises_and_nothing_is_ever_violated(lattice, seed, rounds):
    told = []
    found = expand_views(lattice, lattice.labels, rounds, seed, tell=lambda *state: told.append(state))
    assert list(found.energies) == sorted(found.energies, reverse=True)
    assert [state[:2] for state in told] == list(enumerate(found.energies[1:]))
    assert all(twin_violations(lattice, labels) == 0 for _, _, labels in told)
    assert lattice.violations(found.labels) == 0
    assert twin(lattice, found.labels) == pytest.approx(found.energies[-1] * found.labels.size * lattice.scale)
    again = expand_views(lattice, lattice.labels, rounds, seed, "scipy", threads=2)
    assert (again.labels == found.labels).all()


@given(lattices(rows=2, width=6, planes=4), st.integers(0, 99))
@settings(deadline=None)
def test_violations_are_counted(lattice, seed):
    labels = np.random.default_rng(seed).integers(0, lattice.shifts.shape[1], lattice.labels.shape).astype(np.int32)
    assert lattice.violations(labels) == twin_violations(lattice, labels)
    assert lattice.violations(lattice.labels) == 0


@given(st.integers(-9, 9), st.integers(1, 5), st.integers(2, 5))
def test_a_shift_is_the_nearest_whole_one(first, fineness, views):
    space = DisparitySpace(views, 2, 9, first, first + 6, fineness)
    pairs = view_pairs(views, "all")
    exact = (pairs[:, :1] - pairs[:, 1:]) * np.arange(first, first + 7) / fineness
    assert (np.abs(whole_shifts(space, pairs) - exact) <= 0.5).all()


@pytest.mark.parametrize("fineness", [1, 2, 3])
def test_the_volume_ends_the_rays_of_all_pixels_where_the_maps_do(fineness):
    space = DisparitySpace(3, 2, 7, 0, 5, fineness)
    labels = np.full((2, 3, 7), 4, np.int32)
    maps = disparities(space, labels)
    assert (maps == 4 / fineness).all()
    volume = surfaces(space, maps, (0, 1, 2))
    assert set(np.unique(volume.values)) == {0, 1}
    for view in range(3):
        assert space.in_view(volume.values, view)[:, 4].all()
        assert not space.in_view(visibility(volume, view), view)[:, :4].any()
