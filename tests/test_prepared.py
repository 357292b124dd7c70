"""A comparison that is ready: what it runs, and what it shows of its scenes."""

from pathlib import Path

from attrs import evolve
from compared import SMALL, cells, scored
from places import METHODS

import matbench
from matbench import comparison
from matbench.measures.benchmarks import SETS
from matbench.plans.settings import Settings

TINY = "synthetic/box[size=48x36]"


def test_truth_beyond_a_range_is_told_once_for_each_scene(tmp_path: Path) -> None:
    narrow = "synthetic/box[disparities=0:3 size=96x72]"
    scene = matbench.load_scene(narrow)
    beyond = int((scene.truth[scene.ref].astype(float) * scene.pair_steps > 3).sum())
    assert 0 < beyond < scene.height * scene.width
    ready = comparison.prepare("flat", [SMALL, narrow], plugin=[METHODS], out=tmp_path / "run")
    (remark,) = ready.remarks
    assert remark.startswith(f"{scene.name}: {beyond} of {scene.height * scene.width} pixels")
    ready.run()
    assert remark in ready.report(ready.tables()).read_text("utf-8")


def test_the_same_request_resumes_and_computes_nothing_twice(tmp_path: Path) -> None:
    scored(tmp_path, "flat", "exits")
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


def test_a_scene_spelled_in_two_ways_keeps_its_place_on_the_curve(tmp_path: Path) -> None:
    scenes = ["synthetic/box[size=48x36]", "synthetic/box[size=48x36 views=2,3,5]"]
    ready = comparison.prepare(["flat"], scenes, out=tmp_path / "run", plugin=[METHODS])
    assert len(ready.plan.cells) == 3
    assert ready.plan.spellings == {"synthetic/box[size=48x36 views=5]": "synthetic/box[size=48x36]"}
    assert ready.store.plan() == ready.plan
    ready.run()
    (sweep,) = ready.sweeps(ready.tables().results)
    assert sweep.values == (2, 3, 5)


def test_scenes_suggest_what_their_benchmark_reports(tmp_path: Path) -> None:
    ready = comparison.prepare("flat", TINY, plugin=[METHODS], out=tmp_path / "run", write=False)
    (name,) = ready.scenes
    plain, light = ready.scenes[name], evolve(ready.scenes[name], metrics="hci")
    assert (ready.metrics, ready.further) == (("total_bad_1",), ())
    of_hci = SETS["hci"].metrics
    suggested = evolve(ready, scenes={name: light})
    assert (suggested.metrics, suggested.further) == (of_hci, of_hci)
    mixed = evolve(ready, scenes={name: light, "other": plain})
    assert (mixed.metrics, mixed.further) == (("total_bad_1",), of_hci), "all are computed, none is shown first"
    asked = evolve(suggested, settings=Settings(metrics=("bad_1", "bad_3")))
    assert asked.metrics == ("bad_1", "bad_3")
    assert asked.further == ("bad_3", *of_hci)
    again = evolve(ready, measured=("bad_9", "avg"))
    assert (again.metrics, again.further) == (("total_bad_1",), ("bad_9",))
