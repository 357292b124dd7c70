"""Recordings, read back: what was told is what is in the file, and no half-written file is left."""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from attrs import evolve
from recordings import Teller, make_scene, read

from matbench.algorithm import Context, Estimate, Probe
from matbench.plans.record_option import RecordOption
from matbench.recording import rrd
from matbench.recording.rrd import RecordingError, record, record_scene
from matbench.scene import Scene
from matbench.space import DisparitySpace, Volume


@pytest.mark.parametrize("has_truth", [True, False])
def test_a_scene_alone_is_its_views_truth_and_regions(tmp_path: Path, has_truth: bool) -> None:
    scene = make_scene() if has_truth else evolve(make_scene(), truth={}, regions={})
    record_scene(tmp_path / "scene.rrd", scene)
    rows = read(tmp_path / "scene.rrd")
    names = {entity for entity in rows if not entity.startswith(("/__", "/surface/cameras"))}
    expected = {"/about", *(f"/views/{label}" for label in scene.labels), f"/views/{scene.labels[scene.ref]}/rows"}
    if has_truth:
        expected |= {"/truth/disparity", "/regions", *(f"/regions/{name}" for name in scene.scored_regions)}
        expected |= {"/surface", "/surface/points"}
        expected |= {f"/surface/{line}{names}" for line in ("planes", "rays") for names in ("", "/names")}
        points = rows["/surface/points"][0][1]["Points3D:positions"]
        assert len(rows["/surface/points"]) == 1
        assert points is not None
    assert names == expected
    assert list(tmp_path.iterdir()) == [tmp_path / "scene.rrd"]


def test_one_recording_with_its_blueprint(path: Path) -> None:
    reader = rr.chunk.RrdReader(path)
    assert (len(reader.recordings()), len(reader.blueprints())) == (1, 1)
    assert list(path.parent.iterdir()) == [path]


def test_rerun_verifies_it(path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "rerun_cli", "rrd", "verify", str(path)], capture_output=True, text=True, check=True
    )
    assert "1 file verified without error" in done.stdout + done.stderr
    assert "WARN" not in done.stderr


def test_a_method_that_tells_nothing(tmp_path: Path) -> None:
    scene = make_scene()
    record(tmp_path / "r.rrd", scene, lambda probe: Estimate({1: scene.truth[1]}), title="quiet")
    entities = set(read(tmp_path / "r.rrd"))
    assert {"/estimate/error", "/surface/points"} <= entities
    assert not [e for e in entities if e.startswith(("/volumes", "/haze", "/slices", "/energy", "/passes", "/error/"))]
    assert "/space/answer" in entities, "a map has its place in disparity space, too"


def test_a_scene_of_which_nothing_is_known_and_an_empty_answer(tmp_path: Path) -> None:
    full = make_scene()
    scene = Scene(full.name, full.views, full.labels, 1, full.disparities, {}, 1.0)
    nothing = np.full((20, 30), np.nan, np.float32)
    record(tmp_path / "r.rrd", scene, lambda probe: Estimate({1: nothing}), title="empty")
    entities = set(read(tmp_path / "r.rrd"))
    assert "/estimate/disparity" in entities
    assert not {"/estimate/error", "/truth/disparity", "/regions"} & entities


def test_a_solve_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def solve(probe: Probe) -> Estimate:
        probe.iteration(0, {"total": 1.0})
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        record(tmp_path / "r.rrd", make_scene(), solve, title="t")
    assert list(tmp_path.iterdir()) == []


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, scene = tmp_path / "r.rrd", make_scene()
    path.write_text("old")
    honest = rrd._write

    def cut(*args: Any) -> Any:
        written = honest(*args)
        os.truncate(args[0], os.path.getsize(args[0]) // 2)  # noqa: PTH202
        return written

    monkeypatch.setattr(rrd, "_write", cut)
    with pytest.raises(RecordingError, match="cannot be read back"):
        record(path, scene, lambda probe: Estimate({1: scene.truth[1]}), title="t")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_rerun_did_not_write_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, honest = make_scene(), rrd._write

    def more(*args: Any) -> Any:
        written = honest(*args)
        written["/estimate/lost"] += 1
        return written

    monkeypatch.setattr(rrd, "_write", more)
    with pytest.raises(RecordingError, match="lost"):
        record(tmp_path / "r.rrd", scene, lambda probe: Estimate({1: scene.truth[1]}), title="t")
    assert list(tmp_path.iterdir()) == []


def test_two_recordings_do_not_mix(tmp_path: Path) -> None:
    scene = make_scene()
    for passes in (2, 3):
        teller = Teller(scene, passes)
        solved = lambda probe: teller.solve(scene, Context(probe=probe))  # noqa: B023, E731
        record(tmp_path / f"{passes}.rrd", scene, solved, title="same title")
    for passes in (2, 3):
        assert len(read(tmp_path / f"{passes}.rrd")["/energy/total"]) == passes
    assert not rr.is_enabled()  # and no recording of this process is active


def test_a_row_outside_the_scene(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"row 20 is not one of 0\.\.19"):
        record(tmp_path / "r.rrd", make_scene(), lambda probe: Estimate({}), title="t", wanted=RecordOption(rows=(20,)))


def test_a_quarter_size_cell_is_small_and_quick(tmp_path: Path) -> None:
    scene = make_scene(4, 375, 450, 0, 59)
    space = DisparitySpace.covering(scene.disparities, 4, 375, 450)
    random = np.random.default_rng(0)
    noise = Volume(space, random.random(space.shape, np.float32), (0, 1, 2, 3))  # nothing compresses it
    maps = random.uniform(0, 59, (375, 450)).astype(np.float32)

    def solve(probe: Probe) -> Estimate:
        for i in range(3):
            probe.volume(f"similarity/{i}-{i + 1}", noise)
        for step in range(20):
            probe.iteration(step, {"total": 1.0}, noise, noise, maps)
        return Estimate({1: maps}, noise)

    before = time.process_time()
    record(tmp_path / "r.rrd", scene, solve, title="large")
    seconds = time.process_time() - before
    size = (tmp_path / "r.rrd").stat().st_size
    print(f"{size / 1e6:.1f} MB, {seconds:.2f} s of CPU time")
    assert size < 60e6
    assert seconds < 3  # of CPU time, for what else runs on the machine does not count
