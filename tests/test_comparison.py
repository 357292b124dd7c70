"""A comparison from end to end: methods in their own processes, stored maps, scores, tables."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest
from attrs import evolve
from places import METHODS

import matbench
from matbench import comparison
from matbench.errors import UserError
from matbench.plans.plan import methods
from matbench.plans.request import read_request
from matbench.plans.settings import Settings
from matbench.regions import REGIONS
from matbench.results.scores import RESULT_COLUMNS
from matbench.space import DisparitySpace

SMALL = "synthetic/box[size=96x72]"


def compare(tmp_path: Path, *algorithms: str, scene: str = SMALL, **options: object) -> pd.DataFrame:
    return matbench.compare(list(algorithms), scene, out=tmp_path / "run", plugin=[METHODS], **options)


def cells(tmp_path: Path) -> pd.DataFrame:
    return pd.read_csv(tmp_path / "run" / "cells.csv", keep_default_na=False).set_index("algorithm")


def test_results_are_tidy_and_exact(tmp_path: Path) -> None:
    results = compare(tmp_path, "flat[value=2]")
    assert tuple(results.columns) == RESULT_COLUMNS
    scene = matbench.load_scene(SMALL)
    error = np.abs(2 - scene.truth[scene.ref].astype(float)) * scene.pair_steps
    assert list(results.region.unique()) == list(REGIONS)
    for region, mask in scene.scored_regions.items():
        if not mask.any():
            assert results[results.region == region].value.isna().all()
            continue
        rows = results[results.region == region].set_index("metric")
        known = error[mask]
        assert (rows.pixels == mask.sum()).all()
        assert rows.value["bad_1"] == pytest.approx(100 * np.mean(known > 1.0001))
        assert rows.value["avg"] == pytest.approx(known.mean())
        assert rows.value["invalid"] == 0
    on_disk = pd.read_csv(tmp_path / "run" / "results.csv", keep_default_na=False, na_values=[""])
    pd.testing.assert_frame_equal(on_disk[["metric", "value"]], results[["metric", "value"]])
    assert set(results.params) == {"value=2.0"}


def test_truth_beyond_a_range_is_told_once_for_each_scene(tmp_path: Path) -> None:
    narrow = "synthetic/box[disparities=0:3 size=96x72]"
    scene = matbench.load_scene(narrow)
    beyond = int((scene.truth[scene.ref].astype(float) * scene.pair_steps > 3).sum())
    assert 0 < beyond < scene.height * scene.width
    ready = comparison.prepare("flat", [SMALL, narrow], plugin=[METHODS], out=tmp_path / "run")
    (remark,) = ready.remarks
    assert remark.startswith(f"{scene.name}: {beyond} of {scene.height * scene.width} pixels")
    ready.run()
    assert remark in ready.report(*ready.tables()).read_text("utf-8")


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
    matbench.compare(["opens", "calls"], SMALL, out=tmp_path / "run", plugin=plugin)
    found = cells(tmp_path)
    for name, reason in {
        "opens": "FileNotFoundError: [Errno 2] No such file or directory: '/nowhere/weights.bin' (opens.py:3)",
        "calls": "CalledProcessError: Command '['false']' returned non-zero exit status 1. (opens.py:8)",
    }.items():
        log = f"cells/{found.cell[name]}/log.txt"
        assert (found.status[name], found.reason[name]) == ("failed", f"{reason} (log: {log})")
        assert "Traceback" in (tmp_path / "run" / log).read_text()


def test_an_empty_map_is_totally_bad(tmp_path: Path) -> None:
    results = compare(tmp_path, "empty")
    every = results[results.region == "all"].set_index("metric").value
    assert every["total_bad_1"] == every["invalid"] == 100
    assert every["bad_1"] == 0
    assert np.isnan(every["avg"])


def test_seeds_are_cells_of_their_own_and_repeat_themselves(tmp_path: Path) -> None:
    results = compare(tmp_path, "noise", seed=[0, 1])
    by_seed = results[(results.region == "all") & (results.metric == "avg")].set_index("seed").value
    assert by_seed[0] != by_seed[1]
    again = matbench.compare(["noise"], SMALL, out=tmp_path / "other", plugin=[METHODS], seed=1)
    assert by_seed[1] == again[(again.region == "all") & (again.metric == "avg")].value.item()


def test_the_same_request_resumes_and_computes_nothing_twice(tmp_path: Path) -> None:
    compare(tmp_path, "flat", "exits")
    place = tmp_path / "run" / "cells" / cells(tmp_path).cell["flat"] / "cell.json"
    before = place.stat().st_mtime_ns
    scores = (tmp_path / "run" / "results.csv").read_bytes()
    started = []
    again = comparison.prepare(["flat", "exits"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    again.run(lambda event, cell, outcome: started.append(cell.method.algorithm) if event == "start" else None)
    again.tables()
    assert started == ["exits"]  # what failed is tried again
    assert place.stat().st_mtime_ns == before
    assert (tmp_path / "run" / "results.csv").read_bytes() == scores


def test_changed_code_is_computed_anew(tmp_path: Path) -> None:
    plugin = tmp_path / "mine.py"
    code = METHODS.read_text()
    plugin.write_text(code)
    first = matbench.compare("flat", SMALL, out=tmp_path / "run", plugin=[plugin])
    plugin.write_text(
        code.replace("np.full((scene.height, scene.width), value", "np.full((scene.height, scene.width), value + 3")
    )
    second = matbench.compare("flat", SMALL, out=tmp_path / "run", plugin=[plugin])
    assert not np.allclose(first.value, second.value, equal_nan=True)


def test_a_folder_with_another_plan_is_left_alone(tmp_path: Path) -> None:
    compare(tmp_path, "flat")
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


def test_half_a_cell_is_no_cell(tmp_path: Path) -> None:
    compare(tmp_path, "flat")
    run = tmp_path / "run"
    (run / "cells" / cells(tmp_path).cell["flat"] / "cell.json").write_text('{"outcome": {"sta')
    scores = (run / "results.csv").read_bytes()
    compare(tmp_path, "flat")
    assert (run / "results.csv").read_bytes() == scores
    assert cells(tmp_path).status["flat"] == "ok"


@pytest.mark.parametrize("damage", ["missing", "junk", "pickled", "shape"])
def test_damaged_maps_are_computed_anew(tmp_path: Path, damage: str) -> None:
    compare(tmp_path, "flat")
    run = tmp_path / "run"
    scores = (run / "results.csv").read_bytes()
    maps = run / "cells" / cells(tmp_path).cell["flat"] / "disparity.npz"
    if damage == "missing":
        maps.unlink()
    elif damage == "junk":
        maps.write_bytes(b"nothing like a map")
    elif damage == "pickled":
        np.savez(maps, view_2=np.array([{"a": 1}], object))
    else:
        np.savez(maps, view_2=np.zeros(3, np.float32))
    compare(tmp_path, "flat")
    assert (run / "results.csv").read_bytes() == scores


def _rows(results: pd.DataFrame, metric: str, region: str = "all") -> pd.Series:
    return results[(results.metric == metric) & (results.region == region)].set_index("algorithm").value


def test_volumes_are_kept_on_request_only_and_then_scored(tmp_path: Path) -> None:
    plain = compare(tmp_path, "solid", "flat")
    run = tmp_path / "run"
    place = {name: run / "cells" / key for name, key in cells(tmp_path).cell.items()}
    assert "surface_f_1" not in set(plain.metric)
    assert not (place["solid"] / "volume.npz").exists()
    flat = (place["flat"] / "cell.json").stat().st_mtime_ns

    scored = compare(tmp_path, "solid", "flat", volumes=True)  # the same run, solved again where there is a volume
    assert (place["flat"] / "cell.json").stat().st_mtime_ns == flat
    assert set(_rows(scored, "surface_recall_1").index) == {"solid"}
    scene = matbench.load_scene(SMALL)
    truth = scene.truth[scene.ref].astype(float)
    space = DisparitySpace.covering(scene.disparities, 5, 72, 96)
    middle = float(space.disparities[space.planes // 2])
    near = np.abs(truth - middle) <= 1 + 1e-4
    assert _rows(scored, "surface_recall_1")["solid"] == pytest.approx(100 * near.mean())
    assert _rows(scored, "surface_precision_1")["solid"] == pytest.approx(
        100 * near.sum() / (near | (truth < middle)).sum()
    )
    assert 0 < _rows(scored, "brier", "half_occluded")["solid"] < 1
    curve = pd.read_csv(run / "reliability.csv")
    assert set(curve.materiality.round(3)) == {0, 0.502}  # 128 of 255
    assert "Calibration of materialities" in (run / "report.html").read_text()

    before = (place["solid"] / "cell.json").stat().st_mtime_ns
    again = compare(tmp_path, "solid", "flat", volumes=True)
    assert (place["solid"] / "cell.json").stat().st_mtime_ns == before, "nothing is computed twice"
    pd.testing.assert_frame_equal(again, scored)
    (place["solid"] / "volume.npz").write_bytes(b"junk")
    pd.testing.assert_frame_equal(compare(tmp_path, "solid", "flat", volumes=True), scored)


def test_what_is_no_materiality_is_said_and_costs_nothing_else(tmp_path: Path) -> None:
    results = compare(tmp_path, "solid[material=1.5]", volumes=True)
    found = cells(tmp_path)
    assert found.status["solid"] == "ok"
    assert "surface_f_1" not in set(results.metric)
    log = (tmp_path / "run" / "cells" / found.cell["solid"] / "log.txt").read_text()
    assert "volume not kept" in log
    assert "from 0 to 1" in log
    ready = comparison.prepare(
        "solid[material=1.5]", SMALL, out=tmp_path / "run", plugin=[METHODS], settings=Settings(volumes=True)
    )
    assert not ready.pending().cells


def test_predictions_are_scored_with_and_without_truth(tmp_path: Path) -> None:
    held = "synthetic/box[predict=right size=96x72]"
    results = compare(tmp_path, "flat[value=2]", "flat[value=4]", "empty", scene=held)
    predicted = results[results.metric == "prediction_psnr"]
    assert set(predicted.view) == {"4"}
    assert set(predicted.region) == {"all"}
    assert set(predicted.unit) == {"dB"}
    by_params = predicted.set_index(["algorithm", "params"]).value
    assert by_params["flat", "value=2.0"] > by_params["flat", "value=4.0"], "the wall is at 0.75, the floor nearer"
    assert np.isnan(by_params["empty", ""])
    assert _rows(results, "prediction_coverage")["empty"] == 0
    assert "total_bad_1" in set(results.metric), "where there is truth it counts, too"

    known = matbench.load_scene(held)
    blind = evolve(known, truth={}, regions={}, visible={})
    ready = comparison.prepare("flat[value=2]", held, out=tmp_path / "blind", plugin=[METHODS])
    ready.run()
    ready = evolve(ready, scenes={held: blind})
    made = ready.tables()
    alone = made.results
    assert set(alone.metric) == {"prediction_psnr", "prediction_coverage"}
    assert _rows(alone, "prediction_psnr")["flat"] == by_params["flat", "value=2.0"]
    page = ready.report(made)
    assert "There is no ground truth" in page.read_text()


def test_a_method_too_large_for_the_warm_up_still_competes(tmp_path: Path) -> None:
    results = compare(tmp_path, "needs_room")
    assert cells(tmp_path).status["needs_room"] == "ok"
    assert len(results)


def test_one_scene_in_two_spellings_counts_once(tmp_path: Path) -> None:
    names = ["synthetic/box[size=96x72]", "synthetic/box[seed=0 size=96x72]", "synthetic/box[size=96x72 views=0:5]"]
    results = matbench.compare("flat", names, out=tmp_path / "run", plugin=METHODS)
    assert results.scene.unique().tolist() == names[:1]


@pytest.mark.parametrize("seed", [1.5, "12", None, [], [1, -1], True])
def test_seeds_are_whole_numbers(tmp_path: Path, seed: object) -> None:
    with pytest.raises(UserError, match="whole numbers"):
        compare(tmp_path, "flat", seed=seed)


def test_interrupted_by_the_user_and_taken_up_again(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "flat", "slow", "--plugin", str(METHODS)]
    line += ["-s", SMALL, "--out", str(tmp_path / "run")]
    process = subprocess.Popen(
        line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    wait_until(lambda: any((tmp_path / "run" / "cells").glob("[0-9a-f]*")))
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=150)
    assert process.returncode == 130, said
    assert "the same command goes on from here" in said
    assert "Traceback" not in said
    assert cells(tmp_path).status.to_dict() == {"flat": "ok", "slow": "interrupted"}


def test_told_to_end_it_leaves_nothing_behind(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "flat", "slow", "--plugin", str(METHODS)]
    line += ["-s", SMALL, "--out", str(tmp_path / "run")]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_until(lambda: any((tmp_path / "run" / "cells").glob("[0-9a-f]*")))
    children = psutil.Process(process.pid).children(recursive=True)
    assert children
    process.terminate()
    assert process.wait(timeout=150) == 130
    assert not psutil.wait_procs(children, timeout=60)[1]
    assert not list((tmp_path / "run" / "cells").glob(".*"))


def test_killed_and_taken_up_again(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "flat", "slow", "--plugin", str(METHODS)]
    line += ["-s", SMALL, "--out", str(tmp_path / "run")]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_until(lambda: any((tmp_path / "run" / "cells").glob("[0-9a-f]*")))
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    ready = comparison.prepare(["flat", "slow"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    assert ready.store.outcome(ready.plan.cells[0]).status == "ok"  # type: ignore[union-attr]
    assert [c.method.algorithm for c in ready.pending().cells] == ["slow"]


def wait_until(happens: object, seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not happens():  # type: ignore[operator]
        assert time.monotonic() < end, "it never happened"
        time.sleep(0.05)


def test_a_script_without_a_main_guard_runs_once(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import matbench\n"
        "print('once')\n"
        f"table = matbench.compare('flat', {SMALL!r}, out={str(tmp_path / 'run')!r}, plugin=[{str(METHODS)!r}])\n"
        "print(len(table))\n"
    )
    said = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, check=True).stdout
    assert said.split() == ["once", str(9 * 16)]


def test_the_plan_on_disk_holds_no_code_and_reads_back(tmp_path: Path) -> None:
    ready = comparison.prepare(["flat"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    assert ready.store.plan() == ready.plan
    plan = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert plan["request"]["scenes"] == [SMALL]


@pytest.mark.parametrize("damage", ["[]", "{}", '{"request": 3}', "nonsense", '{"cells": [{"key": "../../x"}]}'])
def test_a_hostile_plan_is_refused(tmp_path: Path, damage: str) -> None:
    ready = comparison.prepare(["flat"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    (tmp_path / "run" / "plan.json").write_text(damage)
    with pytest.raises(UserError):
        ready.store.plan()


def test_timings_and_memory_are_measured(tmp_path: Path) -> None:
    compare(tmp_path, "flat")
    row = cells(tmp_path).loc["flat"]
    assert 0 < float(row.seconds) < 5
    assert 10 < float(row.peak_mb) < 2000


def test_recordings_are_written_on_request_and_found_by_name(tmp_path: Path) -> None:
    compare(tmp_path, "flat", "noise")
    store = comparison.Store(tmp_path / "run")
    with pytest.raises(UserError, match="has no recordings"):
        store.recording()
    scores = (tmp_path / "run" / "results.csv").read_bytes()
    compare(tmp_path, "flat", "noise", record=True)
    assert (tmp_path / "run" / "results.csv").read_bytes() == scores
    with pytest.raises(UserError, match="there are 2 recordings: name one of 'flat on"):
        store.recording()
    with pytest.raises(UserError, match="0 recordings match 'sgbm'"):
        store.recording("sgbm")
    found = store.recording("flat")
    assert found.name == "recording.rrd"
    assert store.recording(found.parent.name) == found
    before = found.stat().st_mtime_ns
    compare(tmp_path, "flat", "noise", record=True)
    assert found.stat().st_mtime_ns == before


def test_recordings_of_another_row_are_made_anew(tmp_path: Path) -> None:
    def shown() -> int:
        (path,) = (tmp_path / "run" / "cells").glob("*/cell.json")
        (row,) = json.loads(path.read_text())["outcome"]["recorded"]["rows"]
        return int(row)

    compare(tmp_path, "flat", record=True)
    assert shown() == 36
    store = comparison.Store(tmp_path / "run")
    before = store.recording().stat().st_mtime_ns
    compare(tmp_path, "flat", record=True, row=36)
    assert store.recording().stat().st_mtime_ns == before
    compare(tmp_path, "flat", record=True, row=20)
    assert (shown(), store.recording().stat().st_mtime_ns > before) == (20, True)
    before = store.recording().stat().st_mtime_ns
    compare(tmp_path, "flat", record=True)
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


def test_a_pattern_leaves_out_what_its_scenes_have_not(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "ablate", "flat", "--plugin", str(METHODS), "--out", "run"]
    line += ["-s", "synthetic/b*[size=48x36 views=2,3,5,9]", "-s", "synthetic/c*[size=48x36 views=2,3,5,9]"]
    line += ["-s", "synthetic/box[size=48x36 n=9 views=2,3,5,9]"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    first = done.stdout.splitlines()[0]
    assert first.startswith("without synthetic/box[size=48x36 views=9], synthetic/curved[size=48x36 views=9]: ")
    assert "curves: run/sweeps.csv" in done.stdout
    assert not (tmp_path / "run" / "ablation.csv").exists(), "no parameter of the method varies"
    table = pd.read_csv(tmp_path / "run" / "sweeps.csv", keep_default_na=False)
    assert set(table["values"]) == {"2 3 5", "2 3 5 9"}


def test_a_scene_spelled_in_two_ways_keeps_its_place_on_the_curve(tmp_path: Path) -> None:
    scenes = ["synthetic/box[size=48x36]", "synthetic/box[size=48x36 views=2,3,5]"]
    ready = comparison.prepare(["flat"], scenes, out=tmp_path / "run", plugin=[METHODS])
    assert len(ready.plan.cells) == 3
    assert ready.plan.spellings == {"synthetic/box[size=48x36 views=5]": "synthetic/box[size=48x36]"}
    assert ready.store.plan() == ready.plan
    ready.run()
    (sweep,) = ready.sweeps(ready.tables().results)
    assert sweep.values == (2, 3, 5)


def test_an_ablation_from_the_command_line(tmp_path: Path) -> None:
    request = tmp_path / "level.toml"
    request.write_text(f'algorithms = ["flat[value=1,2,3]"]\nscenes = ["{SMALL}"]\n')
    line = [sys.executable, "-m", "matbench", "ablate", str(request), "--plugin", str(METHODS), "--out", "run"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "too few scenes" in done.stdout
    table = pd.read_csv(tmp_path / "run" / "ablation.csv").set_index(["level", "region", "metric"])
    scores = (
        pd.read_csv(tmp_path / "run" / "results.csv", keep_default_na=False, na_values={"value": [""]})
        .set_index(["params", "region", "metric"])
        .value
    )
    change = scores["value=3.0", "all", "avg"] - scores["", "all", "avg"]
    assert table.loc[(3.0, "all", "avg"), "change"] == pytest.approx(change)
    assert "What each switch does" in (tmp_path / "run" / "report.html").read_text()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("algorithms = 3", "algorithms is 3, not a list of texts"),
        ("algorithms = ['flat'", "is not TOML"),
        ("scenes = ['synthetic/box']", "names no algorithms"),
        ("algorithm = ['flat']", "did you mean 'algorithms'?"),
    ],
)
def test_a_malformed_request_is_refused(tmp_path: Path, content: str, said: str) -> None:
    (tmp_path / "request.toml").write_text(content)
    with pytest.raises(UserError, match=r"request\.toml") as error:
        read_request(tmp_path / "request.toml")
    assert said in str(error.value)


def test_a_method_in_two_spellings_is_one(tmp_path: Path) -> None:
    selectors = ["materiality[preset=paper]", "materiality[preset=paper passes=50]", "sgbm", "sgbm[fill=true]"]
    assert [str(method) for method in methods(selectors)] == ["materiality[preset=paper]", "sgbm"]


def test_a_recording_that_fails_is_said_and_costs_no_score(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "shy", "--plugin", str(METHODS), "-s", SMALL, "--record"]
    done = subprocess.run([*line, "--out", "run"], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "not recorded: RuntimeError: not before the camera" in done.stdout
    assert "matbench view" not in done.stdout
    assert cells(tmp_path).status["shy"] == "ok"
