"""Patterns and noise that stay the same."""

import pytest

from matbench.datasets.synthetic.textures import pattern

PINNED = [-0.699616, -0.784289, -0.679456, 0.839368, -0.569503, -0.892212]


def test_the_pattern_is_pinned() -> None:
    """It must be the same with every version of NumPy: scores of different machines are compared."""
    marks = pattern(0)
    assert marks.shape == (256, 256, 3)
    assert float(marks.mean()) == pytest.approx(0, abs=0.01)
    assert float(marks.std()) == pytest.approx(1, abs=0.02)
    assert marks[[0, 100], [0, 50]].ravel().tolist() == pytest.approx(PINNED, abs=1e-5)
