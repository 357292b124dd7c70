"""Slices for a paper: what they show is what the method told."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from attrs import evolve
from figures import SMALL, figured
from typing_commands import run as matbench

from matbench import load_scene
from matbench.algorithm import Context
from matbench.plans.record_option import RecordOption
from matbench.recording import reduction
from matbench.recording.probe import CapturingProbe
from matbench.reports import paper_figure, slice_figure
from matbench.space import visibility


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return figured(tmp_path_factory)


def test_a_slice_is_drawn_from_a_second_solve(run: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = ["figure", "slice", str(run), "materiality", "--row", "20", "-o", str(tmp_path / "two.pdf")]
    status, out, err = matbench(capsys, *line)
    assert (status, err) == (0, "")
    assert "differs" not in out
    assert {path.name for path in tmp_path.iterdir()} == {"two.pdf", "two.png", "two.txt", "two.tex"}
    pdf = (tmp_path / "two.pdf").read_bytes()
    assert b"/FontFile2" in pdf
    assert b"/Type3" not in pdf
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", pdf)
    assert box
    assert float(box[1]) == pytest.approx(3.25 * 72, abs=1)
    assert float(box[2]) < paper_figure.TALLEST * 72
    picture = cv2.imread(str(tmp_path / "two.png"))
    assert picture is not None
    assert picture.shape[1] == pytest.approx(3.25 * paper_figure.DOTS, abs=2)
    caption = (tmp_path / "two.txt").read_text()
    for told in ("row 20", SMALL, "materiality[preset=paper passes=3]", "after 3 passes", "px per view step", "(f)"):
        assert told in caption
    assert r"\includegraphics[width=3.25in]{two}" in (tmp_path / "two.tex").read_text()


def test_slices_are_the_arrays_told() -> None:
    """Each picture against the method's own arrays."""
    from matbench.algorithms.materiality import Materiality

    scene = load_scene(SMALL)
    method = evolve(Materiality(**Materiality.presets["paper"]), passes=2)  # type: ignore[arg-type]
    probe = CapturingProbe(RecordOption(rows=(20,)))
    told = {}

    class Both(CapturingProbe):
        def volume(self, name, volume):  # type: ignore[no-untyped-def]
            told[name] = volume.values[20].copy()
            super().volume(name, volume)

    probe = Both(RecordOption(rows=(20,)))
    estimate = method.solve(scene, Context(0, 1, probe))
    plane = slice_figure.epipolar_plane(scene, probe, estimate)
    assert plane is not None
    assert estimate.volume is not None
    pictures = {one.name: one.picture for one in plane.slices}
    assert list(pictures) == ["similarity", "visibility", "materiality", "energy derivative"]
    pairs = np.stack([reduction.as_bytes(values) for values in told.values()], axis=2)
    assert np.array_equal(pictures["similarity"], pairs)
    assert np.array_equal(pictures["materiality"][:, :, 1], reduction.as_bytes(estimate.volume.values[20]))
    seen = reduction.as_bytes(visibility(estimate.volume, 0)[20])
    assert np.array_equal(pictures["visibility"][:, :, 0], seen)
    drawn = slice_figure.draw(scene, plane, "m")
    top = [axis.images[0].get_array() for axis in drawn.figure.axes[:2]]
    assert np.array_equal(top[0], scene.views[scene.ref])
    assert np.array_equal(drawn.figure.axes[4].images[0].get_array(), pictures["materiality"][::-1])
    first = scene.labels[estimate.volume.views[0]]
    assert f"view {first}," in drawn.caption
