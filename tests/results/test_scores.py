"""Tables of scores from stored maps and volumes."""

import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from attrs import evolve
from compared import SMALL, cells, compare, scored
from places import METHODS

import matbench
from matbench import comparison
from matbench.errors import UserError
from matbench.plans.settings import Settings
from matbench.regions import REGIONS
from matbench.results import scores
from matbench.results.scores import RESULT_COLUMNS
from matbench.runs import store
from matbench.runs.cell_files import Solved
from matbench.space import DisparitySpace

TINY = "synthetic/box[size=48x36]"


def test_results_are_tidy_and_exact(tmp_path: Path) -> None:
    results = scored(tmp_path, "flat[value=2]")
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


def test_many_rows_make_the_same_table_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = scored(tmp_path, "flat[value=2]", "empty")
    (tmp_path / "run" / "results.csv").unlink()
    monkeypatch.setattr(scores, "_AT_ONCE", 50)
    pd.testing.assert_frame_equal(scored(tmp_path, "flat[value=2]", "empty"), whole)


def test_an_empty_map_is_totally_bad(tmp_path: Path) -> None:
    results = scored(tmp_path, "empty")
    every = results[results.region == "all"].set_index("metric").value
    assert every["total_bad_1"] == every["invalid"] == 100
    assert every["bad_1"] == 0
    assert np.isnan(every["avg"])


def _rows(results: pd.DataFrame, metric: str, region: str = "all") -> pd.Series:
    return results[(results.metric == metric) & (results.region == region)].set_index("algorithm").value


def test_volumes_are_kept_on_request_only_and_then_scored(tmp_path: Path) -> None:
    plain = scored(tmp_path, "solid", "flat")
    run = tmp_path / "run"
    place = {name: run / "cells" / key for name, key in cells(tmp_path).cell.items()}
    assert "surface_f_1" not in set(plain.metric)
    assert not (place["solid"] / "volume.npz").exists()
    flat = (place["flat"] / "cell.json").stat().st_mtime_ns

    with_volume = compare(tmp_path, "solid", "flat", volumes=True)  # the same run, solved again where there is a volume
    assert (place["flat"] / "cell.json").stat().st_mtime_ns == flat
    assert set(_rows(with_volume, "surface_recall_1").index) == {"solid"}
    scene = matbench.load_scene(SMALL)
    truth = scene.truth[scene.ref].astype(float)
    space = DisparitySpace.covering(scene.disparities, 5, 72, 96)
    middle = float(space.disparities[space.planes // 2])
    near = np.abs(truth - middle) <= 1 + 1e-4
    assert _rows(with_volume, "surface_recall_1")["solid"] == pytest.approx(100 * near.mean())
    assert _rows(with_volume, "surface_precision_1")["solid"] == pytest.approx(
        100 * near.sum() / (near | (truth < middle)).sum()
    )
    assert 0 < _rows(with_volume, "brier", "half_occluded")["solid"] < 1
    curve = pd.read_csv(run / "reliability.csv")
    assert set(curve.materiality.round(3)) == {0, 0.502}  # 128 of 255
    assert "Calibration of materialities" in (run / "report.html").read_text()

    before = (place["solid"] / "cell.json").stat().st_mtime_ns
    again = scored(tmp_path, "solid", "flat", volumes=True)
    assert (place["solid"] / "cell.json").stat().st_mtime_ns == before, "nothing is computed twice"
    pd.testing.assert_frame_equal(again, with_volume)
    (place["solid"] / "volume.npz").write_bytes(b"junk")
    pd.testing.assert_frame_equal(scored(tmp_path, "solid", "flat", volumes=True), with_volume)


def test_what_is_no_materiality_is_said_and_costs_nothing_else(tmp_path: Path) -> None:
    results = scored(tmp_path, "solid[material=1.5]", volumes=True)
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
    results = scored(tmp_path, "flat[value=2]", "flat[value=4]", "empty", scene=held)
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


def test_no_more_maps_are_held_than_two_however_many_cells_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ready = comparison.prepare("noise", SMALL, out=tmp_path / "run", seed=range(3), plugin=METHODS, repeats=3)
    ready.run()
    alive: weakref.WeakSet[Any] = weakref.WeakSet()
    most = 0
    original = store.Store.read

    def read(self: store.Store, *asked: Any) -> Solved:
        nonlocal most
        found = original(self, *asked)
        alive.add(found)
        most = max(most, len(alive))
        return found

    monkeypatch.setattr(store.Store, "read", read)
    assert len(scores.tables(ready.plan, ready.store, ready.scenes).cells) == 3
    assert most <= 3, "the scored one, a repeat, and the next one as it is read"


def test_maps_are_not_scored_against_another_scene(tmp_path: Path) -> None:
    from attrs import evolve

    ready = comparison.prepare("flat", TINY, out=tmp_path / "run", plugin=METHODS)
    ready.run()
    other = matbench.load_scene("synthetic/box[size=48x36 seed=1]")
    with pytest.raises(UserError, match="is not what flat was given"):
        evolve(ready, scenes={TINY: evolve(other, name=TINY)}).tables()
