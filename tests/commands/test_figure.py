"""`matbench figure`: everything one can get wrong."""

from pathlib import Path

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
