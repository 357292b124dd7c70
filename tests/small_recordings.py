"""Recordings of a small scene, written and read."""

from pathlib import Path

import numpy as np
import rerun as rr

from matbench.algorithm import Estimate, Probe
from matbench.plans.record_option import RecordOption
from matbench.recording.rrd import record
from matbench.scene import Range, Scene
from matbench.space import DisparitySpace, Volume


def scene(name: str = "toy/box") -> Scene:
    random = np.random.default_rng(sum(map(ord, name)))
    views = random.integers(0, 256, (3, 12, 20, 3), dtype=np.uint8)
    truth = np.full((12, 20), 2, np.float32)
    return Scene(name, views, ("a", "b", "c"), 1, Range(0, 5), {1: truth}, 1.0, {"all": np.isfinite(truth)})


def write(path: Path, of: Scene, title: str, passes: int, wanted: RecordOption = RecordOption()) -> Path:  # noqa: B008
    """A method with a volume and several passes, or, with none, only a map."""
    space = DisparitySpace.covering(of.disparities, of.n, of.height, of.width)
    volume = Volume(space, np.random.default_rng(passes).random(space.shape, np.float32), (0, 1, 2))
    answer = np.full((12, 20), 1 + passes, np.float32)

    def solve(probe: Probe) -> Estimate:
        for step in range(passes):
            probe.iteration(step, {"total": float(-step)}, volume, volume, answer)
        return Estimate({1: answer}, volume if passes else None)

    record(path, of, solve, title=title, wanted=wanted)
    return path


def rows(path: Path) -> dict[str, list[object]]:
    """Entity -> every row without its identity; chunks may be cut otherwise."""
    found: dict[str, list[object]] = {}
    for chunk in rr.chunk.RrdReader(path).stream():
        for row in chunk.to_record_batch().to_pylist():
            told = {name: value for name, value in row.items() if not name.endswith("RowId")}
            found.setdefault(str(chunk.entity_path), []).append(told)
    return {name: sorted(told, key=lambda row: row.get("iteration", -1)) for name, told in found.items()}  # type: ignore[attr-defined]
