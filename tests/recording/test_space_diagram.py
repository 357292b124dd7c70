"""Volumes and rays in disparity space, as they are drawn."""

from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from recordings import ROW, Row, Teller, read, tensor

from matbench.algorithm import Estimate
from matbench.recording import coloring, space_diagram
from matbench.recording.perspective import Perspective
from matbench.recording.rrd import record
from matbench.scene import Range, Scene
from matbench.space import DisparitySpace, Volume


def strips_of(path: Path, entity: str) -> np.ndarray:
    """(strips, points, 3) of lines that have as many points each."""
    (chunk,) = (chunk for chunk in rr.chunk.RrdReader(path).stream() if str(chunk.entity_path) == entity)
    return np.array(chunk.to_record_batch().column("LineStrips3D:strips")[0].as_py(), np.float64)


def test_volumes_in_space_are_those_of_the_sliders(rows: dict[str, list[Row]]) -> None:
    for name in [entity for entity in rows if entity.startswith("/volumes/")]:
        bytes_ = tensor(rows[name][0][1])
        field = rows[name.replace("/volumes/", "/haze/")][0][1]
        data = field["Volume3D:data"] if "Volume3D:data" in field else field["Volume3D:values"]
        shape, values = data["shape"], np.asarray(data["buffer"]).astype(np.float32)
        expected = bytes_.transpose(1, 0, 2)[::-1] / 255  # nearest plane first, rows, columns
        assert tuple(shape) == expected.shape
        assert np.allclose(values.reshape(shape), expected, atol=1e-3)
        through = field["Volume3D:optical_density"] * np.mean(expected ** field["Volume3D:gamma"])
        assert through == pytest.approx(space_diagram.THROUGH_ALL, rel=0.01), "full or nearly empty, it is seen"


def test_rays_meet_in_the_target_point(path: Path, told: tuple[Scene, Teller]) -> None:
    """Equation 1 drawn: the views' rays, straight in disparity space, cross in one point of the pixel's plane."""
    scene, teller = told
    strips = strips_of(path, "/space/rays")
    assert strips.shape == (scene.n, 2, 3)
    plane = round(float(teller.answer[ROW, 15])) - teller.space.first
    depth = (teller.space.planes - plane - 0.5) / teller.space.planes * scene.width / 2
    near, far = strips[:, 0], strips[:, 1]
    share = (depth - near[:, 2]) / (far[:, 2] - near[:, 2])
    columns = near[:, 0] + share * (far[:, 0] - near[:, 0])
    assert np.allclose(columns, 15 + (plane + teller.space.first) * scene.ref + 0.5, atol=1e-3)
    # in perspective they meet in the surface's point, whose depth is inverse to its disparity
    seen = strips_of(path, "/surface/rays")
    assert np.allclose(seen[:, 1], seen[0, 1], atol=1e-5)
    perspective = Perspective.of(scene)
    assert seen[0, 1, 2] == pytest.approx(perspective.depth(float(teller.answer[ROW, 15])), rel=1e-4)


def test_voxels_of_fewer_views_have_the_colours_of_the_disparity_map(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    views = rng.integers(0, 256, (5, 4, 8, 3), np.uint8)
    truth = np.tile(np.linspace(0, 2, 8, dtype=np.float32), (4, 1))
    scene = Scene("a", views, tuple("01234"), 0, Range(0, 2), {0: truth}, 1)
    space = DisparitySpace(3, 4, 8, 0, 4)  # views 0, 2, 4: disparities are twice those of the scene
    values = np.zeros(space.shape, np.float32)
    values[:, 2] = 1
    path = tmp_path / "a.rrd"
    record(path, scene, lambda probe: Estimate({0: truth}, Volume(space, values, (0, 2, 4))), title="a")
    grid = read(path)["/space/materiality"][0][1]
    colors = np.asarray(grid["VoxelGridMap:colors"]).ravel()
    middle = coloring.disparity_colors(np.array([[1.0]], np.float32), (0, 2))[0, 0]
    assert {tuple(int(c).to_bytes(4, "big")[:3]) for c in colors} == {tuple(middle.tolist())}
