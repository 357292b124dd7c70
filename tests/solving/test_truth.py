"""Truth is out of reach of methods: they search their memory, environment, open files and shared memory for it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from places import TESTS

import matbench
from matbench import Scene, comparison, load_scene
from matbench.plans.plan import methods
from matbench.plans.record_option import RecordOption
from matbench.plans.settings import Settings
from matbench.solving.check_scenes import EASY, trials
from matbench.solving.check_solve import solve_apart

SEARCHING = TESTS / "searching.py"
LENGTH = 192  # bytes
SCENE = "synthetic/spheres[size=96x72]"


def _windows(values: NDArray[np.generic]) -> Iterator[bytes]:
    """Pieces of an array that hold many different bytes, so that nothing else has the same by chance."""
    for row in values.reshape(-1, values.shape[-1]):
        content = np.ascontiguousarray(row).tobytes()
        pieces = [content[at : at + LENGTH] for at in range(0, len(content) - LENGTH + 1, LENGTH)]
        yield from (piece for piece in pieces if len(set(piece)) > 40)


def needles(scene: Scene) -> list[bytes]:
    """What a method must not find: truth of all views, and the view that is held out."""
    secrets = [*scene.truth.values()]
    if scene.held_out is not None:
        secrets.append(scene.held_out.image.reshape(scene.height, -1))
    seen = scene.views.tobytes()
    pieces = [[piece for piece in dict.fromkeys(_windows(secret)) if piece not in seen] for secret in secrets]
    found = [piece for some in pieces for piece in some[:: max(1, len(some) // 4)][:4]]
    assert len(found) >= 4, "too little to look for"
    return found


def looking_for(tmp_path: Path, scene: Scene, options: str = "") -> str:
    """The method that looks for what it must not find of a scene."""
    told = tmp_path / "needles"
    told.write_bytes(b"".join(piece[::-1] for piece in needles(scene)))
    return f"searches[needles={told} length={LENGTH} {options}]"


def search(tmp_path: Path, name: str, options: str = "", settings: Settings = Settings()) -> list[tuple[int, int]]:
    """What is found in every cell, and how much there was to find."""
    method = looking_for(tmp_path, load_scene(name), options)
    out = tmp_path / "run"
    asked = {"plugin": SEARCHING, "out": out, "settings": settings, "seed": [0, 1]}
    matbench.compare(method, name, record=settings.record or False, **asked)
    ready = comparison.prepare(method, name, **asked)
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


def test_no_truth_is_within_reach_of_a_method_that_is_checked(tmp_path: Path) -> None:
    (method,) = methods(looking_for(tmp_path, load_scene(EASY)), [SEARCHING])
    answer = solve_apart(method, [SEARCHING], trials()["easy"], timeout=120)
    assert not answer.error
    assert {float(values.max()) for values in answer.maps.values()} == {0.0}
