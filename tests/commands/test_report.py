"""`matbench report`: the table of a run, printed or written."""

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typing_commands import run as matbench

from matbench.errors import UserError
from matbench.reports import paper, run_tables, tables
from matbench.reports.content import Report


@pytest.fixture
def run(report: Report, tmp_path: Path) -> Path:
    """A run folder without plan, cells and scenes: its tables are enough."""
    report.results.to_csv(tmp_path / "results.csv", index=False)
    report.cells.to_csv(tmp_path / "cells.csv", index=False)
    return tmp_path


def test_the_command_prints_or_writes(run: Path, report: Report, capsys: pytest.CaptureFixture[str]) -> None:
    assert matbench(capsys, "report", str(run), "--format", "md") == (
        0,
        paper.markdown(paper.sheet(report.results, report.cells)),
        "",
    )
    status, out, _ = matbench(capsys, "report", str(run))
    assert status == 0
    assert "10.51" in out
    place = run / "t.csv"
    line = ["report", str(run), "-o", str(place), "-m", "avg", "--region", "occ", "all", "--no-scenes"]
    assert matbench(capsys, *line)[0] == 0
    table = pd.read_csv(place)
    assert list(table.columns) == ["scene", "method", "occ", "all", "mean rank", "metric", "unit", "note"]
    assert set(table.scene) == {"mean"}
    scope = tables.shared(report.results, report.cells)
    expected = tables.means(report.results, scope, "occ", "avg")["good"]
    assert np.isclose(table.occ[0], round(expected, 2))


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["--format", "doc"], "doc"),
        (["-o", "t.doc"], "must end in .tex, .md or .csv"),
        (["-o", "/no/such/t.md"], "folder '/no/such' of --out does not exist"),
        (["-m", "total_bad_3"], "was not scored by total_bad_3: type matbench score"),
        (["-m", "total_bed_1"], "unknown metric 'total_bed_1' of this run: did you mean 'total_bad_1'?"),
        (["-m", "bad_0"], "unknown metric 'bad_0' of this run"),
        (
            ["--metrics", "kitty"],
            "unknown metrics 'kitty': did you mean 'kitti'? Possible: eth3d, hci, kitti, middlebury",
        ),
        (["--region", "ocd"], "unknown region 'ocd' of total_bad_1 in this run: did you mean 'occ'?"),
    ],
)
def test_wrong_usage_is_one_line(run: Path, capsys: pytest.CaptureFixture[str], tokens: list[str], said: str) -> None:
    status, out, err = matbench(capsys, "report", str(run), *tokens)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_a_folder_that_is_no_finished_run(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "cannot be read" in matbench(capsys, "report", str(run / "none"))[2]
    (run / "results.csv").write_text("a,b\n1,2\n")
    assert "is damaged" in matbench(capsys, "report", str(run))[2]
    (run / "results.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match="is damaged"):
        run_tables.read_run(run)


def test_several_metrics_stand_below_one_another(run: Path, report: Report, capsys: pytest.CaptureFixture[str]) -> None:
    one, other = (paper.sheet(report.results, report.cells, name) for name in ("avg", "bad_1"))
    line = ["report", str(run), "-m", "avg", "-m", "bad_1.0", "-m", "avg"]
    assert matbench(capsys, *line, "--format", "md")[1] == f"{paper.markdown(one)}\n{paper.markdown(other)}"
    status, text, _ = matbench(capsys, *line, "--format", "csv")
    table = pd.read_csv(io.StringIO(text))
    assert status == 0
    assert list(table.metric.unique()) == ["avg", "bad_1"]
    assert len(table) == len(one.texts) + len(other.texts)
    status, text, _ = matbench(capsys, *line)
    assert status == 0
    assert "avg (px) by region" in text
    assert "by metric, in 'all'" in text
    assert "bad_1 (%) by region" not in text, "the first one has the tables of its own"
