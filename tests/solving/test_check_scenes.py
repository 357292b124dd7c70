"""The scenes that methods are tried on."""

import numpy as np
import pytest

from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene
from matbench.solving import check_scenes
from matbench.solving.check_scenes import mirrored


def unlike(scene: Scene, sign: int = 1) -> float:
    """Median grey levels by which the outermost views differ from what the reference's exact truth says."""
    gaps = []
    for view in {0, scene.n - 1} - {scene.ref}:
        truth, seen = scene.truth[scene.ref], scene.visible[scene.ref][view]
        at = np.arange(scene.width) - sign * (view - scene.ref) * truth
        column = np.clip(np.round(at), 0, scene.width - 1).astype(int)
        there = np.take_along_axis(scene.views[view].astype(float), column[..., None], axis=1)
        near = np.abs(at - column) < 0.1  # where no sampling is needed
        gaps.append(np.abs(there - scene.views[scene.ref])[seen & near])
    return float(np.median(np.concatenate(gaps)))


@pytest.mark.parametrize("name", [check_scenes.EASY, check_scenes.EITHER_SIGN])
def test_in_a_mirror_exact_truth_still_explains_all_views(name: str) -> None:
    scene = load_scene(name)
    other = mirrored(scene)
    assert other.ref == 3
    assert scene.ref == 1
    assert unlike(other) == unlike(scene) < 3
    assert unlike(other, sign=-1) > 10
    twice = mirrored(other)
    assert np.array_equal(twice.views, scene.views)
    assert twice.labels == scene.labels
    assert np.array_equal(twice.truth[1], scene.truth[1])
    assert np.array_equal(twice.visible[0], scene.visible[0])
