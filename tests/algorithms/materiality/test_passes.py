"""A pass over the rows: in bytes and float32, and with visibilities kept in layers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from materialities import PAIR_SETS, SPACES, pass_over, plain_energy, random_row

from matbench.algorithms.materiality import passes
from matbench.algorithms.similarity import pairs
from matbench.space import DisparitySpace


@pytest.mark.parametrize("which", ["all", "consecutive", "reference"])
@pytest.mark.parametrize("views", [2, 5, 6, 9])
def test_bytes_in_float32_agree_with_float64(which, views):
    space = DisparitySpace(views, 2, 20, -3, 4, 2)
    which = pairs(views, which, 1)
    mu, rho = (np.stack(part) for part in zip(*(random_row(space, which, seed) for seed in (0, 1)), strict=True))
    rho = np.rint(255 * rho).astype(np.uint8)
    exact, slope = pass_over(plain_energy(space, which, rho / 255), mu)
    energy, found = pass_over(plain_energy(space, which, rho, 1 / 255), mu.astype(np.float32))
    assert energy == pytest.approx(exact, rel=1e-5)
    np.testing.assert_allclose(found, slope, atol=1e-4)


@settings(max_examples=15, deadline=None)
@given(SPACES, PAIR_SETS, st.integers(1, 3), st.integers(0, 99))
def test_visibilities_kept_in_layers_change_nothing(space, which, depth, seed):
    which = pairs(space.views, which, space.views // 2)
    mu, rho = (part[None] for part in random_row(space, which, seed))
    space = DisparitySpace(space.views, 1, space.width, space.first, space.last, space.fineness)
    energy, slope = pass_over(plain_energy(space, which, rho), mu)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passes, "LAYER", depth * space.views * (2 * space.columns - space.samples))
        in_layers, slope_in_layers = pass_over(plain_energy(space, which, rho), mu)
    assert in_layers == energy
    np.testing.assert_array_equal(slope_in_layers, slope)
