"""`matbench figure`: everything one can get wrong."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from figures import SMALL, figured
from places import METHODS
from typing_commands import run as matbench


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return figured(tmp_path_factory)


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["slice", "RUN"], "there are 3 cells: name one of materiality[preset=paper passes=3] on "),
        (["slice", "RUN", "sgbm"], "0 cells match 'sgbm'"),
        (["slice", "RUN", "materiality", "--row", "72"], f"row 72 of {SMALL}: 0 to 71 is possible"),
        (["slice", "RUN", "materiality", "--row", "1,2"], "a figure shows one"),
        (["slice", "RUN", "materiality", "--row", "x"], "row 'x' is not a whole number"),
        (["slice", "RUN", "okutomi"], "okutomi_kanade tells nothing of disparity space"),
        (["slice", "RUN", "flat"], "flat is in a file of its own: add --plugin"),
        (["slice", "RUN", "materiality", "-o", "/no/such/x"], "folder '/no/such' of --out does not exist"),
        (["maps", "RUN", "-s", "teddy"], "no scene of this run is or contains 'teddy'"),
        (["maps", "RUN", "-a", "sgbm"], "no method of this run is or contains 'sgbm'"),
        (["maps", "/no/such/run"], "give a run folder"),
        (["ranks", "/no/such/run"], "give the folder of a finished run"),
        (["ranks", "RUN"], "has no tables yet: type matbench score"),
    ],
)
def test_wrong_usage_is_one_line(run: Path, capsys: pytest.CaptureFixture[str], tokens: list[str], said: str) -> None:
    before = sorted(run.iterdir())
    status, _, err = matbench(capsys, "figure", *(str(run) if one == "RUN" else one for one in tokens))
    assert (status, err.count("\n")) == (2, 1)
    assert said in err
    assert sorted(run.iterdir()) == before


def test_a_method_of_a_file_needs_the_file(run: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = ["figure", "slice", str(run), "flat", "--plugin", str(METHODS), "-o", str(tmp_path / "x")]
    assert "flat tells nothing of disparity space" in matbench(capsys, *line)[2]


def test_mean_ranks_are_drawn_from_the_tables_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    draw = np.random.default_rng(0)
    made = [(m, f"d/s{k}", level + draw.normal()) for m, level in (("a", 9), ("b", 30), ("c", 8.9)) for k in range(9)]
    cells = pd.DataFrame(made, columns=["algorithm", "scene", "value"]).assign(params="", reason="", status="ok")
    results = cells.assign(view="v", region="all", metric="total_bad_1", unit="%", pixels=500, answered=100.0)
    for name, table in (("results", results), ("cells", cells.drop(columns="value"))):
        table.to_csv(tmp_path / f"{name}.csv", index=False)
    status, out, err = matbench(capsys, "figure", "ranks", str(tmp_path))
    assert (status, err) == (0, "")
    paths = [tmp_path / f"ranks-total_bad_1-all{end}" for end in (".pdf", ".png", ".txt", ".tex")]
    assert all(path.stat().st_size > 100 for path in paths)
    assert all(str(path) in out.replace("\n", "") for path in paths)
    assert "over 9 scenes" in paths[2].read_text()
    for wrong, said in (
        (["-m", "beauty"], "unknown metric 'beauty' of this run"),
        (["--region", "sky"], "unknown region 'sky' of this run"),
    ):
        assert said in matbench(capsys, "figure", "ranks", str(tmp_path), *wrong)[2]
    results[results["scene"] < "d/s5"].to_csv(tmp_path / "results.csv", index=False)
    cells[cells["scene"] < "d/s5"].to_csv(tmp_path / "cells.csv", index=False)
    assert "from three ranked methods and 6 scenes on" in matbench(capsys, "figure", "ranks", str(tmp_path))[2]
