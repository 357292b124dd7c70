"""Truth is out of reach of methods: they search their memory, environment, open files and shared memory for it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from needles import SEARCHING, looking_for, needles

from matbench import comparison, load_scene
from matbench.plans.record_option import RecordOption
from matbench.plans.settings import Settings
from matbench.rescoring import open_run
from matbench.scenes import kept
from matbench.solving import confinement

SCENE = "synthetic/spheres[size=96x72]"


def search(tmp_path: Path, name: str, options: str = "", settings: Settings = Settings()) -> list[tuple[int, int]]:
    """What is found in every cell, and how much there was to find."""
    method = looking_for(tmp_path, load_scene(name), options)
    out = tmp_path / "run"
    asked = {"plugin": SEARCHING, "out": out, "settings": settings, "seed": [0, 1]}
    ready = comparison.prepare(method, name, **asked)
    ready.run()
    outcomes = [ready.store.outcome(cell) for cell in ready.plan.cells]
    assert all(outcome is not None and outcome.status == "ok" for outcome in outcomes), outcomes
    return [(outcome.work["found"], outcome.work["wanted"]) for outcome in outcomes if outcome is not None]


def test_what_is_within_reach_is_found(tmp_path: Path) -> None:
    for found, wanted in search(tmp_path, SCENE, "plant=true"):
        assert found == wanted >= 4


@pytest.mark.parametrize(
    "settings",
    [
        Settings(),
        Settings(isolation="shared"),
        Settings(jobs=2),
        Settings(record=RecordOption(), isolation="shared"),
        Settings(dask="local", jobs=2),
    ],
    ids=["process", "shared", "jobs", "recorded", "cluster"],
)
def test_no_truth_is_within_reach(tmp_path: Path, settings: Settings) -> None:
    for found, wanted in search(tmp_path, SCENE, settings=settings):
        assert (found, wanted) == (0, wanted)


def test_no_withheld_view_is_within_reach(tmp_path: Path) -> None:
    for found, _ in search(tmp_path, f"{SCENE[:-1]} predict=right]", settings=Settings(isolation="shared")):
        assert found == 0


def test_a_scene_that_is_loaded_by_name_brings_no_truth(tmp_path: Path) -> None:
    for found, _ in search(tmp_path, SCENE, "loads=true"):
        assert found == 0


@pytest.mark.skipif(not confinement.is_possible(), reason="this system lets nobody mount in a namespace of their own")
@pytest.mark.parametrize("options", [["--isolation", "shared"], ["--dask", "local"]])
def test_kept_scenes_are_out_of_reach(tmp_path: Path, options: list[str]) -> None:
    """Where methods are not confined they are found: so the method looks where they are."""
    cache, wanted = tmp_path / "cache" / "matbench" / "scenes", needles(load_scene(SCENE))
    line = [sys.executable, "-m", "matbench", "compare", "-a", looking_for(tmp_path, load_scene(SCENE)), "-s", SCENE]
    line += ["--plugin", str(SEARCHING), "--out", str(tmp_path / "run"), "--only", "all", *options]
    for is_confined in (True, False):
        variables = {kept.VARIABLE: "100", "XDG_CACHE_HOME": str(tmp_path / "cache")}
        variables |= {} if is_confined else {confinement.UNCONFINED: "1"}
        done = subprocess.run(line, env={**os.environ, **variables}, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert any(wanted[0] in path.read_bytes() for path in cache.iterdir())
        ready, _ = open_run(tmp_path / "run")
        (outcome,) = map(ready.store.outcome, ready.plan.cells)
        assert outcome is not None
        assert outcome.work == {"found": 0 if is_confined else len(wanted), "wanted": len(wanted)}
