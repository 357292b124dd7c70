"""Volumes as a run keeps them, and the truth found in them."""

from pathlib import Path

import numpy as np
import pytest
from attrs import evolve
from exact_volumes import SMALL, along

from matbench.datasets.synthetic import SYNTHETIC
from matbench.files.arrays import Arrays
from matbench.measures.volume_metrics import (
    brier,
    precision,
    recall,
)
from matbench.measures.volumes import Rays, StoredVolume
from matbench.scene import Range
from matbench.space import DisparitySpace, Volume, surface


def test_the_truth_is_found_in_a_volume_over_fewer_views_and_finer_planes() -> None:
    """A volume over views 0, 2 and 4 counts disparities in steps twice as wide."""
    scene = SYNTHETIC.load("curved", SMALL, None)
    space = DisparitySpace.covering(Range(-5, 9), 3, scene.height, scene.width, 3)
    wide = scene.truth[2] * np.float32(2)
    known = np.full((scene.height, space.samples), np.nan, np.float32)
    known[:, :: space.fineness] = wide
    stored = StoredVolume.of(surface(space, {1: known}, (0, 2, 4)))
    rays = along(stored, scene)
    assert recall(rays, 0.5) == precision(rays, 0.5) == 100
    tied = rays.surface % 1 == 0.5  # midway between two planes, where either is nearest
    assert tied.mean() < 0.01
    assert brier(Rays(rays.materiality[~tied], rays.surface[~tied])) == 0


def test_storing_rounds_to_255ths_and_nothing_else(exact: tuple[Volume, StoredVolume], tmp_path: Path) -> None:
    volume = exact[0]
    fuzzy = Volume(volume.space, np.random.default_rng(0).random(volume.values.shape, np.float32), volume.views)
    StoredVolume.of(fuzzy).write(tmp_path / "volume.npz")
    found = StoredVolume.read(tmp_path / "volume.npz")
    assert (found.space, found.views) == (volume.space, volume.views)
    assert np.abs(found.levels / 255 - fuzzy.values).max() <= 0.5 / 255 + 1e-6
    np.testing.assert_array_equal(found.rays(3), found.space.in_view(found.levels, 3))


@pytest.mark.parametrize("value", [np.nan, 1.5, -0.2, np.inf])
def test_what_is_no_materiality_is_not_stored(value: float) -> None:
    space = DisparitySpace(2, 3, 8, 0, 2)
    values = np.zeros(space.shape, np.float32)
    values[1, 1, 1] = value
    with pytest.raises(ValueError, match="from 0 to 1"):
        StoredVolume.of(Volume(space, values, (0, 1)))


@pytest.mark.parametrize("damage", ["missing", "junk", "cut", "other", "views", "shape"])
def test_damaged_files_are_no_volume(damage: str, tmp_path: Path) -> None:
    path, space = tmp_path / "volume.npz", DisparitySpace(2, 3, 8, 0, 2)
    stored = StoredVolume.of(Volume(space, np.zeros(space.shape, np.float32), (0, 1)))
    stored.write(path)
    whole = path.read_bytes()
    levels, facts = stored.levels, np.array([2, 3, 8, 0, 2, 1])
    if damage == "missing":
        path.unlink()
    elif damage in ("junk", "cut"):
        path.write_bytes(b"junk" if damage == "junk" else whole[: len(whole) // 2])
    elif damage == "other":
        np.savez(path, view_0=np.zeros(3))
    elif damage == "views":
        np.savez(path, levels=levels, space=facts, views=np.array([1, 0]))
    else:
        np.savez(path, levels=levels[:2], space=facts, views=np.array([0, 1]))
    with pytest.raises((ValueError, OSError)):
        StoredVolume.read(path)


def test_a_volume_that_claims_more_than_its_scene_has_is_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = Arrays.read

    def all_but_levels(self: Arrays, name: str) -> object:
        assert name != "levels"
        return original(self, name)

    scene, path = SYNTHETIC.load("box", SMALL, None), tmp_path / "volume.npz"
    views = tuple(range(scene.n))
    right = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width, 2)
    wrong = (
        evolve(right, rows=scene.height + 1),
        evolve(right, last=right.last + 500),  # many planes of zeros, which pack to next to nothing
        DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width, 17),
    )
    for space in (right, *wrong):
        StoredVolume(space, np.zeros(space.shape, np.uint8), views).write(path)
        assert StoredVolume.read(path).space == space
        if space is right:
            assert StoredVolume.read(path, scene).space == space
            continue
        with monkeypatch.context() as patch:
            patch.setattr(Arrays, "read", all_but_levels)
            with pytest.raises(ValueError, match=r"another scene|more than the scene has use for"):
                StoredVolume.read(path, scene)


def test_unknown_truth_does_not_count(exact: tuple[Volume, StoredVolume]) -> None:
    scene = SYNTHETIC.load("box", SMALL, None)
    truth = scene.truth[2].copy()
    truth[:, 40:] = np.nan
    half = evolve(scene, truth={2: truth})
    rays = along(exact[1], half)
    assert len(rays.surface) == 40 * scene.height
    assert np.isfinite(rays.surface).all()
