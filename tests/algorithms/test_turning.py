import numpy as np
import pytest

from matbench.algorithms.turning import EACH, turn_volume


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("kind", [np.uint16, np.uint32])
@pytest.mark.parametrize("shape", [(1, 3, 1), (2, 1, 5), (35, 7, 3)])
def test_rows_become_columns(shape, kind, threads):
    rows, planes, columns = shape[0] * EACH, shape[1], shape[2] * EACH
    volume = np.random.default_rng(0).integers(0, np.iinfo(kind).max, (rows, planes, columns), kind, endpoint=True)
    out = np.zeros((columns, planes, rows), kind)
    turn_volume(volume, out, threads)
    np.testing.assert_array_equal(out, volume.transpose(2, 1, 0))
