"""Depths of disparities."""

import numpy as np
import pytest
from attrs import evolve
from recordings import make_scene

from matbench.recording.perspective import DEEPEST, Perspective


@pytest.mark.parametrize(("least", "largest"), [(0, 7), (-5, 2), (-3, -3), (0, 0), (4, 9), (1, 60)])
def test_depths_are_positive_and_bounded(least: float, largest: float) -> None:
    scene = evolve(make_scene(least=least, largest=largest), truth={})
    disparity = np.linspace(least, largest, 600, dtype=np.float32).reshape(20, 30)
    perspective = Perspective.of(scene)
    points, _, radii = perspective.surface(disparity, 1000)
    assert points[:, 2].min() == pytest.approx(1) or (least == largest and points[:, 2].min() > 1)
    assert points[:, 2].max() <= DEEPEST + 1e-4
    assert (radii > 0).all()
    assert perspective.is_true == (least == 4), "true perspective where it is possible"
