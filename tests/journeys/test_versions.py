"""Versions of a method: side by side, under labels, and what has changed since an earlier run."""

import csv
import json
from pathlib import Path

import pandas as pd
import pytest
from places import METHODS
from typing_commands import run

from matbench.prepared import Comparison

SMALL = "synthetic/box[size=48x36]"
LABEL = '=1+1 <b>"M" & 100%_{x}, [new] é'
OLD = """
import numpy as np
from helper import SHARE

from matbench import Estimate


class Flat:
    def __init__(self, value: float = 1.0) -> None:
        self.value = value

    def solve(self, scene, context):
        return Estimate({scene.ref: np.full((scene.height, scene.width), SHARE * self.value, np.float32)})
"""


@pytest.fixture
def old(tmp_path: Path) -> Path:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "helper.py").write_text("SHARE = 3\n")
    (tmp_path / "old" / "methods.py").write_text(OLD)
    return tmp_path / "old" / "methods.py"


def test_two_versions_stand_in_every_table_under_their_names(
    tmp_path: Path, old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    line = ["compare", "--plugin", METHODS, "-s", SMALL, "--out", folder, "--isolation", "shared"]
    status, out, err = run(capsys, *line, "-a", "flat", "-a", f"{old}:Flat as '{LABEL}'", "--json")
    assert status == 0, err
    document = json.loads(out)
    assert {row["method"] for row in document["table"]} == {"flat", LABEL}
    assert [one["name"] for one in document["metrics"]] == ["total_bad_1"]
    assert set(document["metrics"][0]["means"]) == {"flat", LABEL}
    assert "against" not in document
    results = pd.read_csv(folder / "results.csv", keep_default_na=False)
    assert set(results.algorithm) == {"flat", f"'{LABEL}"}, "no spreadsheet computes a label"
    values = results[(results.metric == "avg") & (results.region == "all")].value.astype(float).to_list()
    assert values[0] != values[1], "the helper of the old file is its own"
    page = (folder / "report.html").read_text()
    assert '<b>"M"' not in page
    assert "&lt;b&gt;&#34;M&#34; &amp; 100%_{x}" in page.replace("<wbr>", "")
    for ending, shown in (("tex", r"\textless{}b\textgreater{}"), ("md", r"=1+1 &lt;b&gt;"), ("csv", "\"'=1+1 <b>")):
        status, text, err = run(capsys, "report", folder, "--format", ending)
        assert status == 0, err
        assert shown in text
    assert LABEL in {row["method"].lstrip("'") for row in csv.DictReader(text.splitlines())}
    status, out, err = run(capsys, "report", folder)
    assert LABEL.split()[0] in out, err

    # under another name the run goes on, and nothing is solved again
    status, out, err = run(capsys, *line, "-a", "flat as now", "-a", f"{old}:Flat as before")
    assert status == 0, err
    assert "2 of 2 cells are done already" in out
    assert set(pd.read_csv(folder / "results.csv").algorithm) == {"now", "before"}
    status, _, err = run(capsys, "figure", "slice", folder, "before on", "--row", "3")
    assert status == 2
    assert f"before is in a file of its own: add --plugin {old}" in err


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages are not drawn: that takes longer than all else."""
    monkeypatch.setattr(Comparison, "report", lambda ready, *_: ready.folder / "report.html")


@pytest.mark.usefixtures("undrawn")
def test_what_has_changed_since_a_run_is_told_cell_by_cell(
    tmp_path: Path, old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    both = f"{SMALL},synthetic/weak[size=48x36]"
    line = ["compare", "--isolation", "shared"]
    status, _, err = run(capsys, *line, "-a", f"{old}:Flat", "-a", "sgbm", "-s", SMALL, "--out", first)
    assert status == 0, err
    (old.parent / "helper.py").write_text("SHARE = 2\n")
    asked = [*line, "-a", f"{old}:Flat", "-a", "sgbm", "-s", both, "--out", second, "--against", first]
    status, out, err = run(capsys, *asked)
    assert status == 0, err
    assert f"synthetic/weak[size=48x36]: '{first}' has it not, or as another scene" in out
    assert "total_bad_1 (%): mean change since" in " ".join(out.split())
    assert f"changes: {second / 'changes.csv'}" in out
    table = pd.read_csv(second / "changes.csv")
    assert set(table.scene) == {SMALL}
    before, now = (pd.read_csv(folder / "results.csv") for folder in (first, second))
    keys = ["algorithm", "scene", "seed", "region", "metric"]
    wanted = now.set_index(keys).value - before.set_index(keys).value
    found = table.set_index(keys).change
    pd.testing.assert_series_equal(found, wanted.loc[found.index], check_names=False)
    status, out, err = run(capsys, *asked, "--json")
    assert status == 0, err
    effects = {(row["algorithm"], row["region"], row["metric"]): row for row in json.loads(out)["against"]["effects"]}
    assert effects["sgbm", "all", "avg"]["verdict"] == "unchanged"
    assert effects["flat", "all", "avg"]["verdict"] == "too few scenes"
    assert effects["flat", "all", "avg"]["change"] == pytest.approx(wanted["flat", SMALL, 0, "all", "avg"])


@pytest.mark.usefixtures("undrawn")
def test_runs_that_cannot_be_compared_with_are_one_line_before_anything_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_folder, line = tmp_path / "run", ["compare", "--plugin", METHODS, "--isolation", "shared"]
    assert run(capsys, *line, "-a", "flat", "-s", SMALL, "--out", run_folder)[0] == 0
    for more, against, said in (
        (["-a", "noise", "-s", SMALL], run_folder, "has none of these methods: it has flat"),
        (
            ["-a", "flat", "-s", "synthetic/weak[size=48x36]"],
            run_folder,
            "has none of these scenes as they are: synthe",
        ),
        (["-a", "flat", "-s", SMALL], tmp_path / "none", "none"),
    ):
        status, _, err = run(capsys, *line, *more, "--out", tmp_path / "new", "--against", against)
        assert (status, err.count("\n")) == (2, 1)
        assert said in err
        assert not (tmp_path / "new").exists(), "nothing is written"
    status, _, err = run(capsys, *line, "-a", "flat", "-s", SMALL, "--out", run_folder, "--against", run_folder)
    assert status == 2
    assert "is this run itself" in err
    (run_folder / "results.csv").write_text("changed")
    status, _, err = run(capsys, *line, "-a", "flat", "-s", SMALL, "--out", tmp_path / "new", "--against", run_folder)
    assert status == 2
    assert "are stale, they are not as they were written: type matbench score" in err
