"""Rows that nothing couples: each descends on its own."""

import numpy as np
import pytest
from attrs import evolve

from matbench.algorithms.materiality.descent import Descent
from matbench.algorithms.materiality.objective import Energy
from matbench.algorithms.similarity import pairs
from matbench.space import DisparitySpace


class AllRows(Energy):
    """Descends all its rows together."""

    uncoupled = False


@pytest.mark.parametrize(
    ("accelerated", "tolerance", "along"), [(True, 0.0, 0.0), (True, 2e-3, 3.0), (False, 0.0, 0.0)]
)
def test_rows_that_nothing_couples_descend_as_if_alone(accelerated, tolerance, along):
    space, made = DisparitySpace(4, 6, 20, -1, 5, 2), 25
    which, rng = pairs(4, "consecutive"), np.random.default_rng(0)
    rho = rng.integers(0, 256, (space.rows, 3, *space.shape[1:]), dtype=np.uint8)
    weights = np.full(space.shape, 99, np.uint8), np.zeros((*space.shape[:2], space.columns + 1), np.uint8)
    weights[1][..., 1:-1] = 200
    mu = rng.random(space.shape, np.float32)
    common = space.samples, 0.3, True, 0.0, along

    def descend(energy, start, threads=1):
        # steps long enough for energies to rise
        return Descent(made, accelerated, 0.2, tolerance, threads).run(energy, start.copy())

    found, history, passes, updates = descend(Energy(space, which, rho, *common, weights), mu)
    alone = []
    for y in range(space.rows):
        row = slice(y, y + 1)
        energy = AllRows(evolve(space, rows=1), which, rho[row], *common, tuple(part[row] for part in weights))
        alone.append(descend(energy, mu[row]))
        np.testing.assert_allclose(found[y], alone[-1][0][0], atol=1e-5)
    assert passes == max(row[2] for row in alone)
    assert updates == sum(row[3] for row in alone)
    assert len(history["total"]) == passes
    assert history["data"][-1] == pytest.approx(sum(row[1]["data"][-1] for row in alone), rel=1e-5)
    assert history["total"][-1] == pytest.approx(sum(row[1]["total"][-1] for row in alone), rel=1e-5)
    assert any(history["restart"]) or tolerance
    again = descend(Energy(space, which, rho, *common, weights), mu, threads=2)
    np.testing.assert_array_equal(again[0], found)
    assert again[1] == history
