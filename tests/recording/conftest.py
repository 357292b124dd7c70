"""Fixtures of the tests in this folder."""

from pathlib import Path

import pytest
from recordings import OTHER, ROW, Row, Teller, make_scene, read

from matbench.algorithm import Context
from matbench.plans.record_option import RecordOption
from matbench.recording.rrd import record
from matbench.scene import Scene


@pytest.fixture(scope="module")
def told() -> tuple[Scene, Teller]:
    scene = make_scene()
    return scene, Teller(scene)


@pytest.fixture(scope="module")
def path(told: tuple[Scene, Teller], tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene, teller = told
    path = tmp_path_factory.mktemp("cell") / "rrd.rrd"
    estimate = record(
        path,
        scene,
        lambda probe: teller.solve(scene, Context(probe=probe)),
        title="t on s/x",
        wanted=RecordOption(rows=(ROW, OTHER)),
    )
    assert estimate.disparity[1] is teller.answer
    return path


@pytest.fixture(scope="module")
def rows(path: Path) -> dict[str, list[Row]]:
    return read(path)
