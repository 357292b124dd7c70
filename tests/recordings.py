"""A scene and a method that makes everything up, and recordings read back."""

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from matbench.algorithm import Context, Estimate
from matbench.scene import Range, Scene
from matbench.space import DisparitySpace, Volume

ROW, OTHER, PASSES = 9, 14, 7


def make_scene(n: int = 4, height: int = 20, width: int = 30, least: float = 0, largest: float = 7) -> Scene:
    random = np.random.default_rng(0)
    views = random.integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    truth = np.full((height, width), least + 2, np.float32)
    truth[5:12, 10:20] = largest - 1
    truth[0] = np.nan
    known = np.isfinite(truth)
    regions = {"all": known, "nonocc": known & (truth < largest - 1)}
    labels = tuple(f"im{2 * i}" for i in range(n))
    return Scene("toy/box", views, labels, 1, Range(least, largest), {1: truth}, 2.0, regions)


class Teller:
    """A method that makes everything up and tells all of it; it reuses its arrays, as methods may."""

    def __init__(self, scene: Scene, passes: int = PASSES) -> None:
        self.space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
        self.passes, random = passes, np.random.default_rng(1)
        self.pairs = [random.random(self.space.shape, np.float32) for _ in range(scene.n - 1)]
        self.states = [random.random(self.space.shape, np.float32) for _ in range(passes)]
        self.slopes = [random.integers(-1, 2, self.space.shape).astype(np.float32) for _ in range(passes)]
        shape = (scene.height, scene.width)
        self.maps = [random.uniform(0, 7, shape).astype(np.float32) for _ in range(passes)]
        self.answer = random.uniform(0, 7, shape).astype(np.float32)
        self.answer[3:6, :5] = np.nan

    def solve(self, scene: Scene, context: Context) -> Estimate:
        views, probe = tuple(range(scene.n)), context.probe
        reused = np.empty(self.space.shape, np.float32)
        for i, pair in enumerate(self.pairs):
            reused[:] = pair
            probe.volume(f"similarity/{i}-{i + 1}", Volume(self.space, reused, views))
        for step in range(self.passes):
            reused[:] = self.states[step]
            energies = {"total": 10.0 - step, "data": 9.0 - step}
            slopes = Volume(self.space, self.slopes[step], views)
            probe.iteration(step, energies, Volume(self.space, reused, views), slopes, self.maps[step])
        volume = Volume(self.space, self.states[-1], views)
        return Estimate({scene.ref: self.answer}, volume, {"total": [0.0], "late": [3.0, 2.0]})


Row = tuple[int | None, dict[str, Any]]


def read(path: Path) -> dict[str, list[Row]]:
    """Entity -> (iteration or None, component -> value) in order."""
    found: dict[str, list[Row]] = {}
    for chunk in rr.chunk.RrdReader(path).stream():
        assert set(chunk.timeline_names) <= {"iteration"}
        for row in chunk.to_record_batch().to_pylist():
            values = {name: value[0] if isinstance(value, list) and value else value for name, value in row.items()}
            step = values.get("iteration")
            found.setdefault(str(chunk.entity_path), []).append((step, values))
    return {entity: sorted(rows, key=lambda row: -1 if row[0] is None else row[0]) for entity, rows in found.items()}


def tensor(values: dict[str, Any]) -> np.ndarray:
    data = values["Tensor:data"]
    inner = data["buffer"]
    return np.asarray(inner, np.uint8).reshape(data["shape"])
