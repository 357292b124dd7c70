"""A comparison from end to end: methods in their own processes, stored maps, scores, tables."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from compared import SMALL, cells, compare, scored
from places import METHODS

import matbench
from matbench.errors import UserError
from matbench.runs.store import Store

TINY = "synthetic/box[size=48x36]"


def test_one_bad_method_costs_only_its_own_cell(tmp_path: Path) -> None:
    bad = ["exits", "leaves", "raises", "writes", "misshapen", "bare", "peeks", "declines"]
    results = compare(tmp_path, *bad, "flat")
    found = cells(tmp_path)
    assert found.status.to_dict() == {
        "exits": "crashed",
        "leaves": "failed",
        "raises": "failed",
        "writes": "failed",
        "misshapen": "failed",
        "bare": "failed",
        "peeks": "failed",
        "declines": "skipped",
        "flat": "ok",
    }
    assert "exit status 7" in found.reason["exits"]
    line = 1 + next(k for k, said in enumerate(METHODS.read_text().splitlines()) if "third digit" in said)
    log = f"cells/{found.cell['raises']}/log.txt"
    said = "ArithmeticError: the third digit is missing and more"
    assert found.reason["raises"] == f"{said} (methods.py:{line}) (log: {log})"
    assert "read-only" in found.reason["writes"]
    assert "(72, 96)" in found.reason["misshapen"]
    assert "ndarray, not an Estimate" in found.reason["bare"]
    assert found.reason["declines"] == "only scenes with a hundred views"
    assert set(results.algorithm) == {"flat"}
    log = (tmp_path / "run" / "cells" / found.cell["raises"] / "log.txt").read_text()
    assert "about to fail" in log
    assert "ArithmeticError" in log


def test_what_fails_says_what_where_and_where_its_log_is(tmp_path: Path) -> None:
    plugin = tmp_path / "opens.py"
    plugin.write_text(
        "class Opens:\n    def solve(self, scene, context):\n        return open('/nowhere/weights.bin')\n\n"
        "class Calls:\n    def solve(self, scene, context):\n        import subprocess\n"
        "        return subprocess.run(['false'], check=True)\n"
    )
    scored(tmp_path, "opens", "calls", plugin=plugin)
    found = cells(tmp_path)
    for name, reason in {
        "opens": "FileNotFoundError: [Errno 2] No such file or directory: '/nowhere/weights.bin' (opens.py:3)",
        "calls": "CalledProcessError: Command '['false']' returned non-zero exit status 1. (opens.py:8)",
    }.items():
        log = f"cells/{found.cell[name]}/log.txt"
        assert (found.status[name], found.reason[name]) == ("failed", f"{reason} (log: {log})")
        assert "Traceback" in (tmp_path / "run" / log).read_text()


def test_seeds_are_cells_of_their_own_and_repeat_themselves(tmp_path: Path) -> None:
    results = scored(tmp_path, "noise", seed=[0, 1])
    by_seed = results[(results.region == "all") & (results.metric == "avg")].set_index("seed").value
    assert by_seed[0] != by_seed[1]
    again = scored(tmp_path / "other", "noise", seed=1)
    assert by_seed[1] == again[(again.region == "all") & (again.metric == "avg")].value.item()


def test_changed_code_is_computed_anew(tmp_path: Path) -> None:
    plugin = tmp_path / "mine.py"
    code = METHODS.read_text()
    plugin.write_text(code)
    first = scored(tmp_path, "flat", plugin=plugin)
    plugin.write_text(
        code.replace("np.full((scene.height, scene.width), value", "np.full((scene.height, scene.width), value + 3")
    )
    second = scored(tmp_path, "flat", plugin=plugin)
    assert not np.allclose(first.value, second.value, equal_nan=True)


def test_a_folder_with_another_plan_is_left_alone(tmp_path: Path) -> None:
    scored(tmp_path, "flat")
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "run").rglob("*")}
    with pytest.raises(UserError, match="holds a different plan"):
        compare(tmp_path, "flat[value=3]")
    assert {p: p.stat().st_mtime_ns for p in (tmp_path / "run").rglob("*")} == before


def test_a_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.tex").write_text("x")
    with pytest.raises(UserError, match="not empty and holds no run"):
        compare(tmp_path, "flat")
    assert [p.name for p in (tmp_path / "run").iterdir()] == ["thesis.tex"]


def test_a_method_too_large_for_the_warm_up_still_competes(tmp_path: Path) -> None:
    results = scored(tmp_path, "needs_room")
    assert cells(tmp_path).status["needs_room"] == "ok"
    assert len(results)


@pytest.mark.parametrize("seed", [1.5, "12", None, [], [1, -1], True])
def test_seeds_are_whole_numbers(tmp_path: Path, seed: object) -> None:
    with pytest.raises(UserError, match="whole numbers"):
        compare(tmp_path, "flat", seed=seed)


def test_timings_and_memory_are_measured(tmp_path: Path) -> None:
    scored(tmp_path, "flat")
    row = cells(tmp_path).loc["flat"]
    assert 0 < float(row.seconds) < 5
    assert 10 < float(row.peak_mb) < 2000


def test_recordings_of_another_row_are_made_anew(tmp_path: Path) -> None:
    def shown() -> int:
        (path,) = (tmp_path / "run" / "cells").glob("*/cell.json")
        (row,) = json.loads(path.read_text())["outcome"]["recorded"]["rows"]
        return int(row)

    scored(tmp_path, "flat", record=True)
    assert shown() == 36
    store = Store(tmp_path / "run")
    before = store.recording().stat().st_mtime_ns
    compare(tmp_path, "flat", record=True, row=36)
    assert store.recording().stat().st_mtime_ns == before
    compare(tmp_path, "flat", record=True, row=20)
    assert (shown(), store.recording().stat().st_mtime_ns > before) == (20, True)
    before = store.recording().stat().st_mtime_ns
    scored(tmp_path, "flat", record=True)
    assert store.recording().stat().st_mtime_ns == before


def test_a_sweep_of_a_scene_is_a_curve(tmp_path: Path) -> None:
    scene = "synthetic/box[size=96x72 noise=0,2,40]"
    results = compare(tmp_path, "sgbm", "flat", scene=scene)
    table = pd.read_csv(tmp_path / "run" / "sweeps.csv", keep_default_na=False, na_values={"mean": [""]})
    assert set(table.option) == {"noise"}
    for row in table.to_dict("records"):
        one = results[
            (results.algorithm == row["algorithm"])
            & (results.scene == f"synthetic/box[noise={row['value']:g} size=96x72]")
            & (results.region == row["region"])
            & (results.metric == row["metric"])
        ]
        assert row["mean"] == pytest.approx(one.value.item())
    hard = table[(table.metric == "total_bad_1") & (table.region == "all")].set_index(["algorithm", "value"])["mean"]
    assert hard["sgbm", 40] > hard["sgbm", 0], "noise makes it harder"
    assert hard["flat", 40] == hard["flat", 0], "who does not look does not mind"
    assert 'id="curves"' in (tmp_path / "run" / "report.html").read_text()


def test_a_recording_that_fails_is_said_and_costs_no_score(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "shy", "--plugin", str(METHODS), "-s", SMALL, "--record"]
    done = subprocess.run([*line, "--out", "run"], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "not recorded: RuntimeError: not before the camera" in done.stdout
    assert "matbench view" not in done.stdout
    assert cells(tmp_path).status["shy"] == "ok"


@pytest.mark.parametrize("given", [{"out": "a\0b"}, {"plugin": ["a\0b.py"]}])
def test_what_can_be_no_path_is_refused(given: dict[str, object], tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match="is no path: no file can have that name"):
        matbench.compare(["sgbm"], TINY, **given)
    assert list(tmp_path.iterdir()) == []
