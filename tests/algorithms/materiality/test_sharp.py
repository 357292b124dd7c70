"""The energy that is linear between 0 and 1, against brute force in float64."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from materialities import PAIR_SETS, SPACES, random_row, ray_walk

from matbench.algorithms.materiality.objective import Energy
from matbench.algorithms.materiality.sharp import ROUND, SharpEnergy
from matbench.algorithms.similarity import pairs
from matbench.space import DisparitySpace


def rounded(difference):
    size = np.abs(difference)
    return np.where(size < ROUND, size**2 / (2 * ROUND), size - ROUND / 2)


def energies(kind, space, which, seed, per_row=True):
    rng = np.random.default_rng(seed)
    rows = [random_row(space, which, seed + y) for y in range(space.rows)]
    mu, rho = (np.stack(part) for part in zip(*rows, strict=True))
    down = rng.integers(0, 256, space.shape, dtype=np.uint8)
    right = rng.integers(0, 256, (*space.shape[:2], space.columns + 1), dtype=np.uint8)
    right[..., [0, -1]] = 0
    return mu, rho, down, right, kind(space, which, rho, 3.0, 0.3, per_row, 2.0, 1.5, (down, right), 1.0)


@settings(max_examples=15, deadline=None)
@given(SPACES, PAIR_SETS, st.booleans(), st.sampled_from([0.0, 0.5]), st.integers(0, 999))
def test_whole_energy_and_its_gradient(space, which, per_row, beta, seed):
    which = pairs(space.views, which, space.views // 2)
    mu, rho, down, right, energy = energies(SharpEnergy, space, which, seed, per_row)

    def twin(at):
        data = (rho**2).sum()
        for y in range(space.rows):
            seen = [ray_walk(at[y], space, view) for view in range(space.views)]
            data += sum(((1 - 2 * rho[y, p]) * at[y] * seen[i] * seen[j]).sum() for p, (i, j) in enumerate(which))
        excess = at.sum(axis=(1, 2)) - 3.0 if per_row else [at.sum() - 3.0 * space.rows]
        count = 0.3 * np.sum(np.square(excess)) / (3.0 if per_row else 3.0 * space.rows)
        adjacent = (down[:-1] / 255 * 2.0 * rounded(np.diff(at, axis=0))).sum()
        adjacent += (right[..., 1:-1] / 255 * 1.5 * rounded(np.diff(at, axis=2))).sum()
        return data, count, adjacent

    rng = np.random.default_rng(seed)
    before, new, slopes = rng.random(mu.shape), np.empty_like(mu), np.empty_like(mu)
    at = np.clip(mu + beta * (mu - before), 0, 1)
    alone = []
    for threads in (1, 2):
        found = energy.step(mu, before, beta, 0.01, new, slopes, threads)
        in_place = before.copy()
        assert energy.step(mu, in_place, beta, 0.01, in_place, None, threads) == pytest.approx(found, rel=1e-12)
        np.testing.assert_allclose(in_place, new, rtol=1e-12, atol=1e-14)
        alone.append(in_place)
        # the constant, the sum of rho^2, is summed in single precision
        assert [found[part] for part in ("data", "count", "adjacent")] == pytest.approx(twin(at), rel=1e-6, abs=1e-6)
        assert found["total"] == pytest.approx(sum(twin(at)), rel=1e-6, abs=1e-6)
        np.testing.assert_allclose(new, np.clip(at - 0.01 * slopes, 0, 1), atol=1e-12)
    np.testing.assert_array_equal(*alone)
    points = list(np.ndindex(mu.shape))
    for point in [points[m] for m in rng.permutation(len(points))[:5]]:
        high, low = at.copy(), at.copy()
        high[point] += 1e-6
        low[point] -= 1e-6
        assert slopes[point] == pytest.approx((sum(twin(high)) - sum(twin(low))) / 2e-6, abs=1e-4)


@settings(max_examples=15, deadline=None)
@given(SPACES, PAIR_SETS, st.integers(0, 999))
def test_on_zeros_and_ones_it_is_the_energy_of_squares(space, which, seed):
    which = pairs(space.views, which, space.views // 2)
    values = []
    for kind in (Energy, SharpEnergy):
        mu, *_, energy = energies(kind, space, which, seed)
        solid = np.rint(mu)
        values.append(energy.step(solid, solid, 0.0, 0.0, np.empty_like(mu), None, 1))
    squares, sharp = values
    for part in ("data", "count"):
        assert sharp[part] == pytest.approx(squares[part], rel=1e-6, abs=1e-6)
    assert sharp["adjacent"] == pytest.approx(squares["adjacent"] * (1 - ROUND / 2), rel=1e-9)


def test_squares_reward_two_halves_and_linear_terms_do_not():
    """Two equally similar candidates on one ray: one opaque, or half of it."""
    space, which = DisparitySpace(2, 1, 4, 0, 1), pairs(2, "consecutive")
    rho = np.zeros((1, 1, *space.shape[1:]))
    rho[0, 0, :, 2] = 1
    none = np.zeros((1, 0, 0), np.uint8)
    found = {}
    for kind in (Energy, SharpEnergy):
        energy = kind(space, which, rho, 1.0, 0.0, True, 0.0, 0.0, (none, none), 1.0)
        for near in (1.0, 0.5):
            mu = np.zeros(space.shape)
            mu[0, :, 2] = 1 - near if near == 1 else 1, near
            found[kind, near] = energy.step(mu, mu, 0.0, 0.0, np.empty_like(mu), None, 1)["data"]
    assert found[Energy, 1.0] == pytest.approx(1)
    assert found[Energy, 0.5] == pytest.approx(0.5)
    assert found[SharpEnergy, 1.0] == found[SharpEnergy, 0.5] == pytest.approx(1)
