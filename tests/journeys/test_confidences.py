"""Confidence maps from the method to the page: stored, checked, scored, drawn, exported, and refused where wrong."""

from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
from places import TESTS
from sureness import ramp
from typing_commands import run as matbench

from matbench import comparison, load_scene
from matbench.measures.confidence import RankedErrors, area, sparsification_error
from matbench.prepared import Comparison
from matbench.results import archive

PLUGIN = TESTS / "sureness.py"
SCENE = "synthetic/spheres[size=96x72]"


def ready(tmp_path: Path, *methods: str) -> Comparison:
    return comparison.prepare(list(methods), SCENE, plugin=PLUGIN, out=tmp_path / "run")


def done(tmp_path: Path, *methods: str) -> Comparison:
    made = ready(tmp_path, *methods)
    made.run()
    return made


def test_confidence_is_scored_where_there_is_one(tmp_path: Path) -> None:
    made = done(tmp_path, "sure", "sure[kind=none]")
    found = made.tables()
    scene = load_scene(SCENE)
    truth, known = scene.truth[scene.ref], np.isfinite(scene.truth[scene.ref])
    errors = np.abs(3.0 - truth[known].astype(np.float64)) * scene.pair_steps
    ranked = RankedErrors.of(errors, ramp(72, 96)[known])
    rows = found.results[found.results["metric"].isin(["aurc_1", "ause_1", "ause"])]
    assert set(rows["params"]) == {""}, "a method without confidence has no row"
    assert set(rows["region"]) == set(scene.scored_regions)
    of_all = rows[rows["region"] == "all"].set_index("metric")["value"]
    inside = scene.scored_regions["all"] & known
    part = RankedErrors.of(np.abs(3.0 - truth[inside].astype(float)) * scene.pair_steps, ramp(72, 96)[inside])
    assert of_all["aurc_1"] == pytest.approx(area(part, 1))
    assert of_all["ause"] == pytest.approx(sparsification_error(part))
    last = found.sparsification.iloc[-1]
    assert (last["coverage"], last["pixels"]) == (100, errors.size)
    assert last["risk"] == pytest.approx(100 * float((errors > 1.0001).mean()))
    assert ranked.error.size == errors.size

    table = pd.read_csv(tmp_path / "run" / "sparsification.csv", dtype={"params": str}).fillna({"params": ""})
    pd.testing.assert_frame_equal(table, found.sparsification, check_dtype=False)


def test_nothing_is_solved_again_unless_it_is_damaged(tmp_path: Path) -> None:
    made = done(tmp_path, "sure")
    before = made.tables()
    assert not ready(tmp_path, "sure").pending().cells
    (cell,) = made.plan.cells
    path = made.store.cell(cell) / "confidence.npz"
    content = path.read_bytes()
    with path.open("wb") as file:
        np.savez_compressed(file, view_2=ramp(72, 96) / 2)  # a right file of another confidence
    for damaged in (path.read_bytes(), b"junk", content[:-30], b""):
        path.write_bytes(damaged)
        assert ready(tmp_path, "sure").pending().cells == (cell,)
    path.unlink()
    found = done(tmp_path, "sure").tables()
    pd.testing.assert_frame_equal(found.results, before.results)
    assert path.read_bytes() == content


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("large", "runs from 0 to 2, not within 0 to 1"),
        ("small", "not (72, 96) numbers"),
        ("elsewhere", "none of the reference view"),
        ("list", "the confidence is list, not a map for each view"),
        ("text", "not (72, 96) numbers"),
    ],
)
def test_what_is_no_confidence_fails_its_cell(tmp_path: Path, kind: str, said: str) -> None:
    made = done(tmp_path, f"sure[kind={kind}]")
    (cell,) = made.plan.cells
    outcome = made.store.outcome(cell)
    assert outcome is not None
    assert (outcome.status, said in outcome.reason) == ("failed", True), outcome.reason


def test_it_is_exported_and_comes_back(tmp_path: Path) -> None:
    made = done(tmp_path, "sure")
    made.tables()
    path, lacking = archive.export(tmp_path / "run", tmp_path / "run.zip")
    assert not lacking
    (cell,) = made.plan.cells
    assert {f"cells/{cell.key}/confidence.npz", "sparsification.csv"} <= set(ZipFile(path).namelist())
    archive.unpack(path, tmp_path / "again")
    assert (tmp_path / "again" / "sparsification.csv").read_bytes() == (
        tmp_path / "run" / "sparsification.csv"
    ).read_bytes()


def test_it_is_shown_and_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["compare", "--plugin", str(PLUGIN), "-s", SCENE, "--out", str(tmp_path / "run")]
    status, _, err = matbench(capsys, *line, "-a", "sure", "-a", "sure[value=4]", "-a", "sure[kind=none]")
    assert (status, err) == (0, "")
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Confidence: are the surest answers the best?" in page
    assert page.count("<svg") >= 2
    assert matbench(capsys, "figure", "confidence", str(tmp_path / "run"), "-a", "sure")[0] == 0
    assert (tmp_path / "run" / "confidence.pdf").stat().st_size > 1000
    assert "1 scene," in (tmp_path / "run" / "confidence.txt").read_text()
    said = matbench(capsys, "figure", "confidence", str(tmp_path / "run"), "-a", "kind=none")[2]
    assert said.startswith("matbench: none of these methods has a confidence to draw: sure[kind=none]; that takes")


def test_a_run_without_confidence_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done(tmp_path, "sure[kind=none]").tables()
    status, _, err = matbench(capsys, "figure", "confidence", str(tmp_path / "run"))
    assert (status, err.count("\n")) == (2, 1)
    assert "has no confidence to draw: that takes a method that gives one, as materiality does" in err


def test_a_check_sees_a_confidence_that_does_not_repeat(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = matbench(capsys, "check", "sure", "--plugin", str(PLUGIN))
    assert "confidence, volume or work differ" not in out
    status, out, _ = matbench(capsys, "check", "sure[kind=large]", "--plugin", str(PLUGIN))
    assert status == 1
    assert "not within 0 to 1" in " ".join(out.split())
