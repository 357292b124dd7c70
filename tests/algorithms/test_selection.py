"""What several views cost, against sorted lists."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.selection import select


def twin(costs, selection, ref):
    """The cost of one point, from the list of those of its views."""
    known = [cost for cost in costs if np.isfinite(cost)]
    if not known:
        return np.nan
    if selection == "side":
        sides = [[cost for cost in side if np.isfinite(cost)] for side in (costs[:ref], costs[ref:])]
        return min(np.mean(side) for side in sides if side)
    return np.mean(sorted(known)[: (len(known) + 1) // 2] if selection == "half" else known)


@settings(deadline=None)
@given(
    st.integers(1, 6), st.integers(0, 6), st.sampled_from(["mean", "half", "side"]), st.integers(0, 999), st.booleans()
)
def test_each_point_takes_the_views_that_the_rule_names(views, ref, selection, seed, apart):
    rng = np.random.default_rng(seed)
    costs = rng.integers(0, 5, (views, 2, 5)).astype(np.float32) + np.float32(0.25)
    costs[rng.random(costs.shape) < 0.3] = np.nan
    given_costs = np.ascontiguousarray(costs.transpose(1, 2, 0)).transpose(2, 0, 1) if apart else costs
    found = select(given_costs, selection, min(ref, views))
    for y, x in np.ndindex(2, 5):
        expected = twin(costs[:, y, x].tolist(), selection, min(ref, views))
        assert found[y, x] == pytest.approx(expected, rel=1e-6, nan_ok=True)
