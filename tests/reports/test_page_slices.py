"""Slices that a page shows."""

import numpy as np
import pytest
from attrs import evolve
from rigs import uneven

from matbench.measures.volumes import StoredVolume
from matbench.reports import page_slices
from matbench.scenes.catalogue import load_scene
from matbench.space import DisparitySpace, Volume, surface, visibility


@pytest.mark.parametrize("kept", [(), (0, 2, 5)])
def test_similarity_is_highest_at_the_truth(kept: tuple[int, ...]) -> None:
    scene = uneven(load_scene("synthetic/box[n=6 ref=2]"), kept, 2) if kept else load_scene("synthetic/box")
    row = scene.height // 2
    found = page_slices.similarity(scene, row)
    low, high = found.ends
    planes = np.linspace(high, low, 2 * len(found.values) + 1)[1::2]
    seen = scene.scored_regions["seen_in_all"][row]
    best = planes[found.values.argmax(axis=0)]
    step = planes[0] - planes[1]
    near = np.abs(best - scene.truth[scene.ref][row]) <= step
    assert near[seen].mean() > 0.9
    outside = page_slices.similarity(
        evolve(scene, views=np.zeros_like(scene.views), truth={}, regions={}, visible={}), row
    )
    assert outside.values[:, scene.width // 2].min() == 255, "all black is all alike"


def test_a_row_of_a_volume_is_that_of_the_whole_volume() -> None:
    scene = load_scene("synthetic/box[n=4]")
    space = DisparitySpace.covering(scene.disparities, 3, scene.height, scene.width, 2)
    random = np.random.default_rng(0)
    volume = Volume(space, random.integers(0, 256, space.shape).astype(np.float32) / 255, (0, 1, 2))
    stored = StoredVolume.of(volume)
    row, ref = 17, scene.ref
    found = page_slices.materiality(stored, scene, row)
    assert found is not None
    material, sight = found
    assert np.array_equal(material.values[::-1], space.in_view(stored.levels, ref)[row])
    share = np.mean([space.in_view(visibility(volume, v), ref)[row] for v in range(3)], axis=0)
    assert np.abs(sight.values[::-1].astype(float) - 255 * share).max() <= 1
    assert material.ends == ((space.first - 0.5) / 2, (space.last + 0.5) / 2)
    assert page_slices.materiality(evolve(stored, views=(1, 2, 3)), evolve(scene, ref=0), row) is None


def test_the_slice_of_a_known_surface_lies_at_its_disparity() -> None:
    scene = load_scene("synthetic/box")
    truth = scene.truth[scene.ref]
    space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
    stored = StoredVolume.of(surface(space, {scene.ref: truth}, tuple(range(scene.n))))
    found = page_slices.materiality(stored, scene, 90)
    assert found is not None
    low, high = found[0].ends
    top = np.argmax(found[0].values > 127, axis=0)
    disparity = high - (top + 0.5) * (high - low) / len(found[0].values)
    assert np.abs(disparity - truth[90]).max() <= 0.5 + 1e-6
