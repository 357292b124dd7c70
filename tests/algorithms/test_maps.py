"""Ready-made maps stand in the table like a method's, but have no time."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from compared import scored

import matbench
from matbench import load_scene
from matbench.algorithm import Context
from matbench.algorithms.maps import Maps
from matbench.comparison import prepare
from matbench.errors import UserError

SCENES = ["synthetic/box[size=48x36]", "synthetic/curved[size=48x36]"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Maps of both scenes: the truth in pixels of the pair."""
    place = tmp_path / "maps"
    place.mkdir()
    for name in SCENES:
        scene = load_scene(name)
        np.save(place / f"{scene.name.partition('/')[2]}.npy", scene.truth[scene.ref] * scene.pair_steps)
    return place


def solved(folder: Path, **options: object) -> np.ndarray:
    scene = load_scene(SCENES[0])
    return np.array(Maps(str(folder), **options).solve(scene, Context()).disparity[scene.ref])  # type: ignore[arg-type]


def test_stored_numbers_become_pixels_of_a_view_step(folder: Path) -> None:
    scene, file = load_scene(SCENES[0]), folder / "box[size=48x36].npy"
    truth = scene.truth[scene.ref]
    assert np.allclose(solved(folder), truth)
    np.save(file, -256 * truth)
    assert np.allclose(solved(folder, unit="step", scale=256.0, sign=-1), truth, rtol=1e-5)
    stored = np.array(truth * scene.pair_steps)
    stored[:5] = -1
    np.save(file, stored)
    found = solved(folder, unknown=-1.0)
    assert np.isnan(found[:5]).all()
    assert np.allclose(found[5:], truth[5:])


def test_smaller_maps_are_refused_or_put_in_the_middle(folder: Path) -> None:
    scene, file = load_scene(SCENES[0]), folder / "box[size=48x36].npy"
    np.save(file, (scene.truth[scene.ref] * scene.pair_steps)[3:-3, 4:-4])
    with pytest.raises(UserError, match="40x30 px, its view 48x36: give the whole map, or crop=centre"):
        solved(folder)
    found = solved(folder, crop="centre")
    assert np.allclose(found[3:-3, 4:-4], scene.truth[scene.ref][3:-3, 4:-4])
    assert np.isnan(found).sum() == found.size - 40 * 30
    np.save(file, np.zeros((100, 100), np.float32))
    with pytest.raises(UserError, match="very same pixels"):
        solved(folder, crop="centre")


def test_they_are_scored_but_take_no_place_by_time_or_memory(folder: Path, tmp_path: Path) -> None:
    results = matbench.compare([f"maps[folder='{folder}']", "sgbm"], SCENES, out=tmp_path / "run")
    mine = results[(results["algorithm"] == "maps") & (results["metric"] == "total_bad_1")]
    assert set(mine["value"].dropna()) == {0}
    cells = pd.read_csv(tmp_path / "run" / "cells.csv").set_index("algorithm")
    assert cells.loc["maps", ["seconds", "peak_mb", "processor_seconds"]].isna().all(axis=None)
    assert (cells.loc["maps", "status"] == "ok").all()
    assert cells.loc["sgbm", ["seconds", "peak_mb"]].notna().all(axis=None)
    assert (tmp_path / "run" / "report.html").is_file()


@pytest.mark.parametrize("given", ["number", "table"])
def test_a_time_that_was_measured_elsewhere_is_shown_and_not_ranked(given: str, folder: Path, tmp_path: Path) -> None:
    times = tmp_path / "times.csv"
    times.write_text("scene,seconds\nbox[size=48x36],2.5\nsynthetic/curved,2.5\n")
    option = "seconds=2.5" if given == "number" else f"times='{times}'"
    scored(tmp_path, f"maps[folder='{folder}' {option}]", scene=SCENES, plugin=None)
    cells = pd.read_csv(tmp_path / "run" / "cells.csv")
    assert list(cells["seconds"]) == [2.5, 2.5]
    assert cells["doubt"].notna().all()


def test_one_changed_file_makes_one_cell_stale(folder: Path, tmp_path: Path) -> None:
    def keys() -> dict[str, str]:
        ready = prepare([f"maps[folder='{folder}']"], SCENES, out=tmp_path / "run", write=False)
        return {cell.scene: cell.key for cell in ready.plan.cells}

    before = keys()
    file = folder / "box[size=48x36].npy"
    np.save(file, np.load(file) + 1)
    after = keys()
    assert {scene for scene in before if before[scene] != after[scene]} == {SCENES[0]}


def test_a_missing_map_fails_its_own_cell_and_says_why(folder: Path, tmp_path: Path) -> None:
    (folder / "box[size=48x36].npy").unlink()
    scored(tmp_path, f"maps[folder='{folder}']", scene=SCENES, plugin=None)
    cells = pd.read_csv(tmp_path / "run" / "cells.csv").set_index("scene")
    assert cells.loc[SCENES[1], "status"] == "ok"
    assert cells.loc[SCENES[0], "status"] == "failed"
    assert "has no map of synthetic/box" in cells.loc[SCENES[0], "reason"]


def test_a_folder_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="does not exist"):
        prepare([f"maps[folder='{tmp_path / 'none'}']"], SCENES, out=tmp_path / "run")
