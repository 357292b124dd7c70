"""Cameras: what is projected by them lands where disparities say."""

import numpy as np
import pytest

from matbench.algorithms.cameras import DEEPEST, Rig
from matbench.scene import Range, Scene


def scene_of(least: float, largest: float, positions: tuple[float, ...] = ()) -> Scene:
    views = np.zeros((3, 5, 40, 3), np.uint8)
    return Scene("three", views, ("0", "1", "2"), 1, Range(least, largest), {}, 1, positions=positions)


@pytest.mark.parametrize("positions", [(), (0, 1, 2.5)])
@pytest.mark.parametrize(("least", "largest"), [(0, 8), (-4, 4), (2, 8), (-9, -3), (0, 0), (5, 5)])
def test_a_point_is_seen_where_its_disparity_says(least: float, largest: float, positions: tuple[float, ...]) -> None:
    scene = scene_of(least, largest, positions)
    rig = Rig.of(scene)
    near, far = rig.depths
    assert 0 < near <= far <= DEEPEST * near * (1 + 1e-9)
    for d in np.linspace(least, largest, 4):
        depth = scene.width / (d + rig.shift)
        assert rig.disparity(np.array([[depth]])) == pytest.approx(d, abs=1e-4)
        x, y = 17.0, 3.0
        point = np.linalg.inv(rig.intrinsics(1)) @ [x, y, 1] * depth
        for view in range(3):
            seen = rig.intrinsics(view) @ rig.extrinsics(view) @ [*point, 1]
            np.testing.assert_allclose(seen[:2] / seen[2], [x - scene.steps(view) * d, y], atol=1e-9)


def test_depths_at_or_behind_the_camera_are_no_answer() -> None:
    rig = Rig.of(scene_of(2, 8))
    assert rig.shift == 0
    np.testing.assert_array_equal(
        rig.disparity(np.array([[0, -1, np.inf, np.nan, 10]])), np.array([[np.nan] * 4 + [4]], np.float32)
    )
