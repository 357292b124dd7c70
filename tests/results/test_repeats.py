"""Methods that repeat themselves, and those that do not."""

import json
import platform
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from places import METHODS

import matbench
from matbench.cli import main
from matbench.errors import UserError
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
