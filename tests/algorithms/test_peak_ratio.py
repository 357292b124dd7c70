"""The ratio of costs against plain comparison, pixel by pixel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.peak_ratio import peak_ratio


def slow(cost, planes):
    """1 - C(answer) / least C of the planes that are not beside it, 0 at least, by Python's own numbers."""
    out = np.full(planes.shape, np.nan)
    for (y, x), answer in np.ndenumerate(planes):
        if np.isnan(answer):
            continue
        here = round(float(answer))
        others = [float(cost[y, k, x]) for k in range(cost.shape[1]) if abs(k - here) > 1]
        others = [value for value in others if not np.isnan(value)]
        own = float(cost[y, here, x])
        is_known = bool(others) and not np.isnan(own) and own < min(others)
        out[y, x] = 1 - own / min(others) if is_known else 0
    return out


@settings(deadline=None)
@given(
    st.tuples(st.integers(1, 4), st.integers(1, 6), st.integers(1, 9)),
    st.sampled_from(["float32", "uint16", "uint32"]),
    st.integers(0, 99),
)
def test_ratios_are_those_of_plain_comparison(shape, kind, seed):
    rng = np.random.default_rng(seed)
    rows, planes, columns = shape
    cost = rng.integers(0, 6, shape).astype(kind)
    if kind == "float32":
        cost[rng.random(shape) < 0.2] = np.nan
    answers = rng.uniform(0, planes - 1, (rows, columns)).astype(np.float32)
    answers[np.abs(answers % 1 - 0.5) < 0.01] = 0  # halves are rounded either way
    answers[rng.random((rows, columns)) < 0.2] = np.nan
    wide = np.concatenate([cost, np.ones((rows, planes, 2), kind)], axis=2)  # columns beyond the image
    for given_cost in (cost, wide):
        for threads in (1, 2):
            found = peak_ratio(given_cost, answers, threads)
            assert found.dtype == np.float32
            np.testing.assert_allclose(found, slow(cost, answers), rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(
    ("costs", "wanted"), [((0, 9, 9, 9), 1), ((4, 9, 8, 9), 0.5), ((8, 0, 8, 9), 0), ((0, 0, 0, 0), 0)]
)
def test_clear_and_unclear_answers(costs, wanted):
    cost = np.array(costs, np.float32).reshape(1, -1, 1)
    assert peak_ratio(cost, np.zeros((1, 1), np.float32)).item() == wanted
