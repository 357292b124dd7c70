"""Runs that are opened and scored again, and runs that are joined."""

import json
from pathlib import Path

import pandas as pd
import pytest
from finished_runs import SMALL, done
from places import METHODS
from typing_commands import run

from matbench.errors import UserError
from matbench.rescoring import join, open_run
from matbench.results.archive import export


def test_missing_and_changed_scenes_are_said_and_nothing_is_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = done(tmp_path / "run", "flat", scene=f"{SMALL},synthetic/weak[size=48x36]")
    before = (folder / "results.csv").read_bytes()
    plan = (folder / "plan.json").read_text()
    (folder / "plan.json").write_text(plan.replace("synthetic/weak", "middlebury2006/Rocks1"))
    status, _, err = run(capsys, "score", folder)
    assert status == 2
    assert err.count("\n") == 1
    assert "1 of 2 scenes: middlebury2006/Rocks1" in err
    assert "it is not here" in err
    assert (folder / "results.csv").read_bytes() == before
    status, out, err = run(capsys, "score", folder, "--partial")
    assert status == 0, err
    assert "without middlebury2006/Rocks1" in out
    assert set(pd.read_csv(folder / "results.csv").scene) == {SMALL}


def test_runs_are_joined_where_they_are_alike_and_refused_where_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = done(tmp_path / "one", "flat", "noise"), done(tmp_path / "two", "noise", "empty")
    status, _, err = run(capsys, "score", one, two, "--out", tmp_path / "both")
    assert status == 0, err
    both = pd.read_csv(tmp_path / "both" / "results.csv", keep_default_na=False)
    assert list(both.algorithm.unique()) == ["flat", "noise", "empty"]
    assert not both.duplicated(["algorithm", "scene", "seed", "region", "metric"]).any()
    assert export(tmp_path / "both")[1] == 0
    assert run(capsys, "score", one, two)[0] == 2

    mine = tmp_path / "mine.py"
    mine.write_text(METHODS.read_text() + "\nOTHER = 1\n")
    other = done(tmp_path / "other", "flat", plugin=mine)
    with pytest.raises(UserError, match=r"flat has other code or parameters in .*other.* than in .*one"):
        join([one, other], tmp_path / "joint")
    assert not (tmp_path / "joint").exists()
    plan = json.loads((two / "plan.json").read_text())
    for cell in plan["cells"]:
        cell["scene_digest"] = "0" * 64
    (two / "plan.json").write_text(json.dumps(plan))
    with pytest.raises(UserError, match="is another scene"):
        join([one, two], tmp_path / "joint")
    with pytest.raises(UserError, match="its pixels, views or range have changed"):
        open_run(two)
    ready, _ = open_run(one)
    place = ready.store.cell(ready.plan.cells[1])
    twin = done(tmp_path / "twin", "noise")
    (there,) = (twin / "cells").iterdir()
    facts = json.loads((there / "cell.json").read_text())
    facts["outcome"] |= {"status": "failed", "maps": ""}
    (there / "cell.json").write_text(json.dumps(facts))
    assert there.name == place.name
    joined = join([twin, one], tmp_path / "joint")
    outcome = joined.outcome(ready.plan.cells[1])
    assert outcome is not None
    assert outcome.status == "ok", "of two, that which ended well"
