"""The document of `--json`: numbers are those of the tables, and what is no number is null."""

import json
from pathlib import Path

import pandas as pd
import pytest
from places import METHODS

from matbench import comparison
from matbench.commands import json_document
from matbench.reports import tables

SCENES = ["synthetic/box[size=48x36]", "synthetic/box[noise=4 size=48x36]"]


def test_its_numbers_are_those_of_the_tables(tmp_path: Path) -> None:
    ready = comparison.prepare(["flat[value=2,3]", "raises"], SCENES, plugin=[METHODS], out=tmp_path / "run")
    ready.run()
    made = ready.tables()
    written = {"scores": ready.folder / "results.csv"}
    found = json_document.document(ready, made.results, made.cells, ["bad_1", "total_bad_1"], written, stopped=True)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert (found["interrupted"], found["cells"]) == (True, {"ok": 4, "failed": 2})
    assert found["metric"] == {"name": "bad_1", "unit": "%", "better": "lower"}
    summary = tables.summary(made.results, made.cells, "bad_1", "lower")
    assert [row["method"] for row in found["table"]] == summary.index.tolist()
    for row in found["table"]:
        said = summary.loc[row["method"]]
        for region, mean in row["regions"].items():
            assert mean == (None if pd.isna(said[f"bad_1 {region}"]) else said[f"bad_1 {region}"])
    assert found["table"][-1]["method"] == "raises"
    assert found["table"][-1]["regions"]["all"] is None
    assert [one["scene"] for one in found["unscored"]] == SCENES
    assert all("the third digit is missing" in one["reason"] for one in found["unscored"])
    assert [one["name"] for one in found["metrics"]] == ["bad_1", "total_bad_1"]
    best = found["table"][0]["method"]
    for one in found["metrics"]:
        values = made.results.query("metric == @one['name'] and region == 'all'").groupby("params")["value"].mean()
        assert one["means"][best]["all"] == pytest.approx(values[best.removeprefix("flat[").removesuffix("]")])


def test_changes_since_an_earlier_run_have_no_nan() -> None:
    effects = pd.DataFrame({"algorithm": ["flat"], "change": [-0.5], "low": [float("nan")], "high": [float("inf")]})
    found = json_document.since(Path("runs/old"), effects)
    assert found == {
        "folder": "runs/old",
        "effects": [{"algorithm": "flat", "change": -0.5, "low": None, "high": None}],
    }
