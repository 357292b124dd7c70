"""Weights of ties between neighbours."""

import numpy as np

from matbench.algorithms.materiality.edges import edge_weights
from matbench.space import DisparitySpace


def test_edge_weights_are_means_over_the_views_that_see():
    space = DisparitySpace(2, 3, 4, 0, 1)
    rows = np.random.default_rng(0).random((2, 3, 3, 4), np.float32) * 50
    down, right = edge_weights(rows, space, 10.0)
    w = np.exp(-np.abs(np.diff(rows, axis=2)).mean(axis=1) / 10)
    # plane 1: view 1 starts one column later
    assert down[0, 1, 0] == round(255 * float(w[0, 0, 0]))
    assert down[0, 1, 2] == round(255 * float(w[0, 0, 2] + w[1, 0, 1]) / 2)
    w = np.exp(-np.abs(np.diff(rows, axis=3)).mean(axis=1) / 10)
    assert right[1, 0, 3] == round(255 * float(w[0, 1, 2] + w[1, 1, 2]) / 2)
    assert not right[..., [0, -1]].any()
    assert not down[-1].any()
