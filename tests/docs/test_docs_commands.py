"""The commands that the documentation shows for built-in scenes and scenes of one's own are run, one after another."""

from pathlib import Path

import pytest
from following import Desk, lines, shortened, stage, table
from machines import Machines
from shown import SCENE
from tools import need
from waiting import wait_until

from matbench.cli import app
from matbench.recording import viewer

HEAD = "tcp://head:8786"


def test_commands_run_one_after_another(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[bool] = []
    monkeypatch.setattr(viewer, "view", lambda path, web: seen.append(path.is_file()))
    for line in sorted(lines("plain"), key=stage):
        desk.follow(shortened(line, RUN="runs/mine"))
        if " scene new " in line:
            (desk.folder / "my_scene" / "scene.toml").write_text(SCENE)
    assert len(seen) == sum(" view " in line for line in lines("plain"))
    assert all(seen)
    assert (desk.runs[0] / "report.html").is_file()
    assert b"\\toprule" in Path("table.tex").read_bytes()
    assert table(Path("runs/both/results.csv"))


@pytest.mark.parametrize("line", lines("dask"), ids=str)
def test_commands_run_on_a_cluster(line: str, desk: Desk, request: pytest.FixtureRequest) -> None:
    need("dask")
    address = ""
    if HEAD in line:
        machines: Machines = request.getfixturevalue("machines")
        machines.add("--no-nanny")
        wait_until(machines.pids)
        address = machines.address
    desk.follow(shortened(line, **{HEAD: address}))
    assert {row["alone"] for row in table(desk.runs[-1] / "cells.csv")} == {"False"}


@pytest.mark.parametrize("line", lines("fetch"), ids=str)
def test_downloads_are_ready_to_begin(line: str, desk: Desk, tmp_path: Path) -> None:
    assert "middlebury" in desk.follow(shortened(line, DIR=str(tmp_path)))


@pytest.mark.parametrize("line", lines("help"), ids=str)
def test_commands_explain_themselves(line: str, desk: Desk) -> None:
    for name in (name for name in app if not name.startswith("-")):
        assert f"matbench {name}" in desk.follow(shortened(line, COMMAND=name))
