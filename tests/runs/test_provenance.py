"""What a run ran on, whether methods repeat themselves, and times that may not be compared."""

import json
import platform
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from places import METHODS

import matbench
from matbench import comparison
from matbench.cli import main
from matbench.errors import UserError
from matbench.plans.settings import Settings
from matbench.reports import costs, tables, terminal
from matbench.results import freshness
from matbench.runs import provenance

SMALL = "synthetic/box[size=48x36]"
PLUGIN = """
import numpy as np
from matbench import Estimate

class Rolls:
    def solve(self, scene, context):
        return Estimate({scene.ref: np.random.default_rng().random(scene.views.shape[1:3], np.float32)})

class Seeded:
    def solve(self, scene, context):
        return Estimate({scene.ref: np.random.default_rng(context.seed).random(scene.views.shape[1:3], np.float32)})
"""


def test_a_method_that_does_not_repeat_itself_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plugin, run = tmp_path / "dice.py", tmp_path / "run"
    plugin.write_text(PLUGIN)
    line = ["compare", "-a", "rolls", "seeded", "--plugin", plugin, "-s", SMALL, "--out", run]
    scores = []
    for repeats in ("1", "3"):
        with pytest.raises(SystemExit) as stop:
            main([str(token) for token in (*line, "--repeats", repeats)])
        assert not stop.value.code
        scores.append((run / "results.csv").read_bytes())
    assert scores[0] == scores[1], "repeats add no scores, and nothing is solved anew for them"
    out = " ".join(capsys.readouterr().out.split())
    assert f"does not repeat itself: rolls on {SMALL}: 3 solves gave 3 answers, which differ in 100 %" in out
    assert "does not repeat itself: seeded" not in out
    cells = pd.read_csv(run / "cells.csv").set_index("algorithm")
    assert cells.repeats.to_dict() == {"rolls": "differ: 3 answers of 3", "seeded": "same: 3"}
    page = (run / "report.html").read_text()
    assert "not repeatable" in page
    assert "3 solves gave 3 answers" in page
    assert len(list(run.glob("cells/*/cell.json"))) == 6

    facts = [json.loads(path.read_text())["outcome"] for path in run.glob("cells/*/cell.json")]
    assert len({outcome["maps"] for outcome in facts}) == 4, "three of the dice, one of the seed"
    for outcome in facts:
        ran = outcome["ran_on"]
        assert ran["python"] == platform.python_version()
        assert ran["numpy"] == np.__version__
        assert ran["commit"] == provenance.commit()
        assert ran["machine"] == provenance.ran_on()["machine"]
        assert {"processor", "cores", "memory", "governor", "system", "numba", "scipy", "matbench"} <= set(ran)
        assert platform.node() not in ran.values(), "the host's name is not given away"
        assert outcome["threads"] >= 1
    assert ran["machine"] in page
    with pytest.raises(UserError, match="repeats 0 is not a whole number from 1 to 100"):
        matbench.compare("flat", SMALL, out=run, plugin=METHODS, repeats=0)


def _cells(**columns: list[object]) -> pd.DataFrame:
    fixed = {"params": "", "seed": 0, "status": "ok", "threads": 2}
    return pd.DataFrame({**columns, **{key: value for key, value in fixed.items() if key not in columns}})


def _results(cells: pd.DataFrame) -> pd.DataFrame:
    rows = cells[["algorithm", "params", "scene", "seed"]].assign(view="2", region="all", metric="total_bad_1")
    return rows.assign(value=1.0, unit="%", pixels=10)


def test_times_of_two_machines_are_not_ranked() -> None:
    cells = _cells(
        algorithm=["a", "a", "b", "b", "c", "c"],
        scene=["x", "y"] * 3,
        seconds=[1.0, 3.0, 0.1, 0.1, 5.0, 5.0],
        machine=["one", "one", "two", "two", "one", "one"],
    )

    def ranked(cells: pd.DataFrame) -> set[str]:
        rows = tables.summary(_results(cells), cells)
        return set(rows.index[rows["alike"]])

    seconds = tables.summary(_results(cells), cells)["seconds"]
    assert seconds.to_dict() == {"a": 2.0, "b": 0.1, "c": 5.0}
    assert ranked(cells) == {"a", "c"}, "b ran elsewhere, and was not faster"
    assert "of 4 of 6 cells" in costs.timing_note(cells)
    mixed = cells.assign(machine=["one", "two", "one", "one", "one", "one"])
    assert ranked(mixed) == {"b", "c"}
    assert np.isnan(tables.summary(_results(mixed), mixed)["seconds"]["a"]), "no mean over machines"
    assert ranked(cells.assign(machine="one", alone=[True, True, True, False, True, True])) == {"a", "c"}
    assert ranked(cells.assign(machine="one", threads=[2, 2, 4, 4, 2, 2])) == {"a", "c"}
    same = cells.assign(machine="one")
    assert costs.timing_note(same) == ""
    assert ranked(same) == ranked(same.drop(columns="machine")) == {"a", "b", "c"}
    printed = terminal.tables(_results(cells), cells)
    assert "another machine" in str(printed[0].caption)


def test_tables_say_how_they_were_made(tmp_path: Path) -> None:
    ready = comparison.prepare(["flat", "noise"], SMALL, out=tmp_path / "run", plugin=METHODS)
    assert "none that say" in freshness.fault(ready.plan, ready.store)
    ready.run()
    ready.tables()
    assert freshness.fault(ready.plan, ready.store) == ""
    path = ready.folder / "scores.json"
    made = json.loads(path.read_text())
    path.write_text(json.dumps({**made, "scorer": "0" * 16}))
    assert "another scorer (0000000000000000" in freshness.fault(ready.plan, ready.store)
    path.write_text(json.dumps(made))
    ready.store.remove(ready.plan.cells[0])
    assert freshness.fault(ready.plan, ready.store) == "cells were computed since"


def test_two_scenes_of_one_name_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A data set that calls two scenes the same: stood in for, as none that is built in does."""
    from attrs import evolve

    original = comparison.load_scene
    monkeypatch.setattr(comparison, "load_scene", lambda name, data: evolve(original(name, data), name="x/same"))
    with pytest.raises(UserError, match="two different scenes are called x/same"):
        comparison.prepare(
            "flat", [SMALL, "synthetic/weak[size=48x36]"], out=tmp_path / "run", plugin=METHODS, settings=Settings()
        )
    assert not (tmp_path / "run").exists()


def test_maps_are_not_scored_against_another_scene(tmp_path: Path) -> None:
    from attrs import evolve

    ready = comparison.prepare("flat", SMALL, out=tmp_path / "run", plugin=METHODS)
    ready.run()
    other = matbench.load_scene("synthetic/box[size=48x36 seed=1]")
    with pytest.raises(UserError, match="is not what flat was given"):
        evolve(ready, scenes={SMALL: evolve(other, name=SMALL)}).tables()


def test_facts_of_several_machines_are_all_shown() -> None:
    assert provenance.combined([{"machine": "a", "numpy": "2"}, {"machine": "b", "numpy": "2"}]) == {
        "machine": "a; b",
        "numpy": "2",
    }
