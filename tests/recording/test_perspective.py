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


def test_rays_of_views_at_uneven_steps_begin_where_the_views_lie_and_meet_the_point() -> None:
    scene = make_scene()
    uneven = evolve(scene, positions=tuple(place * (1.5 if place == scene.n - 1 else 1) for place in scene.places))
    perspective = Perspective.of(uneven)
    own = perspective.ray(scene.ref, (3, 5), 1.0)
    for view in range(scene.n):
        ray = perspective.ray(view, (3, 5), 1.0)
        assert ray[0][0] == pytest.approx(uneven.steps(view) * perspective.baseline)
        assert ray[1] == own[1]
