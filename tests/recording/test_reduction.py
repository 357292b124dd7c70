"""Volumes made small."""

import numpy as np
import pytest

from matbench.recording import reduction
from matbench.space import DisparitySpace, Volume, visibility


@pytest.mark.parametrize("fineness", [1, 2])
def test_a_reduced_volume_is_exact_where_it_is_kept(fineness: int) -> None:
    space = DisparitySpace(3, 40, 60, -4, 9, fineness)
    values = np.random.default_rng(0).random(space.shape, np.float32)
    volume = Volume(space, values, (0, 1, 2))
    small = reduction.reduce_volume(volume, 17, limit=values.size // 8)
    assert small.values.size <= values.size // 8
    rows, planes, columns = small.steps
    assert planes == 1
    assert (17 - small.first_row) % rows == 0
    assert np.array_equal(small.values, np.rint(255 * values[small.first_row :: rows, :, ::columns]))
    seen = reduction.reduce_volume(volume, 17, view=2, limit=values.size // 8)
    assert np.array_equal(seen.values, np.rint(255 * visibility(volume, 2)[small.first_row :: rows, :, ::columns]))
    tiny = reduction.reduce_volume(volume, 17, limit=20)
    assert tiny.values.size <= 20
