"""Runs that are opened and scored again, and runs that are joined."""

import json
from pathlib import Path

import pandas as pd
import pytest
from finished_runs import SMALL, done
from places import METHODS
from typing_commands import run

from matbench.errors import UserError
from matbench.prepared import Comparison
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


OTHER = METHODS.read_text() + "\n\nCHANGED = 1\n"


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages are not drawn: that takes longer than all else."""
    monkeypatch.setattr(Comparison, "report", lambda ready, *_: ready.folder / "report.html")


@pytest.mark.usefixtures("undrawn")
def test_runs_of_other_code_are_joined_under_a_label(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "old").mkdir()
    older = tmp_path / "old" / "methods.py"
    older.write_text(OTHER)
    for helper in METHODS.parent.glob("*.py"):
        if helper != METHODS:
            (tmp_path / "old" / helper.name).symlink_to(helper)
    now, old = done(tmp_path / "now", "flat", "sgbm"), done(tmp_path / "old_run", "flat", "sgbm", plugin=older)
    status, _, err = run(capsys, "score", now, old, "--out", tmp_path / "both")
    assert status == 2
    assert "flat has other code or parameters" in err
    assert "a label tells them apart, as in 'RUN as before'" in err
    status, _, err = run(capsys, "score", f"{old} as 'before, = 1+1'", now, "--out", tmp_path / "both")
    assert status == 0, err
    table = pd.read_csv(tmp_path / "both" / "results.csv")
    assert set(table.algorithm) == {"flat", "sgbm", "flat (before, = 1+1)"}, "what is the same stands there once"
    scores = table[(table.metric == "avg") & (table.region == "all")].set_index("algorithm").value
    assert scores["flat"] == scores["flat (before, = 1+1)"]
    again = run(capsys, "score", tmp_path / "both")
    assert again[0] == 0
    assert "byte for byte" in again[1]
    for line, said in (
        ([f"{now} as x", "--out", tmp_path / "n"], "a label tells a run from others"),
        ([now, f"{now} as x", "--out", tmp_path / "n"], "label 'x' is for no method"),
        ([now, f"{now} as ' '", "--out", tmp_path / "n"], "is empty: write SELECTOR as LABEL"),
        ([now, f"{tmp_path / 'none'} as x", "--out", tmp_path / "n"], "does not exist"),
    ):
        status, _, err = run(capsys, "score", *line)
        assert (status, err.count("\n")) == (2, 1)
        assert said in err
        assert not (tmp_path / "n").exists()


@pytest.mark.usefixtures("undrawn")
def test_a_run_keeps_the_metrics_that_were_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = done(tmp_path / "run", "flat")
    before = (folder / "results.csv").read_bytes()
    status, out, err = run(capsys, "score", folder, "-m", "bad_0.07", "-m", "d1")
    assert status == 0, err
    assert "by metric, in 'all'" in out
    more = pd.read_csv(folder / "results.csv")
    assert {"bad_0.07", "total_bad_0.07", "d1"} <= set(more.metric)
    assert (folder / "results.csv").read_bytes() != before
    status, out, err = run(capsys, "score", folder)
    assert status == 0, err
    assert "the scores are what they were, byte for byte" in out
