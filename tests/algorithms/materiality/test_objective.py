"""The whole energy and its gradient against brute force in float64."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from materialities import PAIR_SETS, SPACES, data_energy, random_row

from matbench.algorithms.materiality.objective import Energy
from matbench.algorithms.similarity import pairs


@settings(max_examples=15, deadline=None)
@given(SPACES, PAIR_SETS, st.booleans(), st.integers(0, 999))
def test_whole_energy_and_its_gradient(space, which, per_row, seed):
    which = pairs(space.views, which, space.views // 2)
    rng = np.random.default_rng(seed)
    rows = [random_row(space, which, seed + y) for y in range(space.rows)]
    mu, rho = (np.stack(part) for part in zip(*rows, strict=True))
    down = rng.integers(0, 256, space.shape, dtype=np.uint8)
    right = rng.integers(0, 256, (*space.shape[:2], space.columns + 1), dtype=np.uint8)
    right[..., [0, -1]] = 0
    energy = Energy(space, which, rho, 3.0, 0.3, per_row, 2.0, 1.5, (down, right), 1.0)

    def twin(at):
        data = sum(data_energy(at[y], rho[y], space, which) for y in range(space.rows))
        excess = at.sum(axis=(1, 2)) - 3.0 if per_row else [at.sum() - 3.0 * space.rows]
        count = 0.3 * np.sum(np.square(excess)) / (3.0 if per_row else 3.0 * space.rows)
        adjacent = (down[:-1] / 255 * 2.0 * np.diff(at, axis=0) ** 2).sum()
        adjacent += (right[..., 1:-1] / 255 * 1.5 * np.diff(at, axis=2) ** 2).sum()
        return data, count, adjacent

    before, new, slopes = rng.random(mu.shape), np.empty_like(mu), np.empty_like(mu)
    at = np.clip(mu + 0.5 * (mu - before), 0, 1)
    alone = []
    for threads in (1, 2):
        found = energy.step(mu, before, 0.5, 0.01, new, slopes, threads)
        # a pass that keeps slopes may be compiled to round otherwise
        in_place = before.copy()
        assert energy.step(mu, in_place, 0.5, 0.01, in_place, None, threads) == pytest.approx(found, rel=1e-12)
        np.testing.assert_allclose(in_place, new, rtol=1e-12, atol=1e-14)
        alone.append(in_place)
        assert [found[part] for part in ("data", "count", "adjacent")] == pytest.approx(twin(at), rel=1e-9, abs=1e-9)
        assert found["total"] == pytest.approx(sum(twin(at)), rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(new, np.clip(at - 0.01 * slopes, 0, 1), atol=1e-12)
    np.testing.assert_array_equal(*alone)
    points = list(np.ndindex(mu.shape))
    for point in [points[m] for m in rng.permutation(len(points))[:5]]:
        high, low = at.copy(), at.copy()
        high[point] += 1e-3
        low[point] -= 1e-3
        assert slopes[point] == pytest.approx((sum(twin(high)) - sum(twin(low))) / 2e-3, abs=1e-7)


@settings(max_examples=15, deadline=None)
@given(SPACES, PAIR_SETS, st.booleans(), st.sampled_from([0.0, 0.7]), st.integers(0, 999))
def test_what_the_next_pass_counts_is_added_up_by_the_pass_before(space, which, per_row, ahead, seed):
    which = pairs(space.views, which, space.views // 2)
    rng = np.random.default_rng(seed)
    rows = [random_row(space, which, seed + y) for y in range(space.rows)]
    mu, rho = (np.stack(part) for part in zip(*rows, strict=True))
    none = np.zeros((space.rows, 0, 0), np.uint8)
    energy = Energy(space, which, rho, 3.0, 0.3, per_row, 0.0, 0.0, (none, none), 1.0)
    before, found = rng.random(mu.shape), {}
    for threads in (1, 2):
        counts, new = np.full((2, space.rows), np.nan), before.copy()
        alone = energy.step(mu, before, 0.4, 0.05, np.empty_like(mu), None, threads)
        assert energy.step(mu, new, 0.4, 0.05, new, None, threads, counts, ahead) == alone
        point = np.clip(new + ahead * (new - mu), 0, 1)
        np.testing.assert_allclose(counts[1], point.sum(axis=(1, 2)), rtol=1e-12)
        # the next pass is the same with and without
        plain, told = np.empty_like(mu), np.empty_like(mu)
        expected = energy.step(new, mu, ahead, 0.05, plain, None, threads)
        counts[0] = counts[1]
        assert energy.step(new, mu, ahead, 0.05, told, None, threads, counts) == pytest.approx(expected, rel=1e-12)
        np.testing.assert_allclose(told, plain, rtol=1e-12, atol=1e-14)
        found[threads] = told
    np.testing.assert_array_equal(found[1], found[2])
