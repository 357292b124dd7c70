"""Changes since an earlier run, in the terminal."""

import io

import pandas as pd
from rich.console import Console

from matbench.reports.changes import MOST, terminal
from matbench.results.changes import COLUMNS, effects


def cells(*changed: float, metric: str = "total_bad_1", region: str = "all") -> pd.DataFrame:
    rows = [
        ("mine", "", f"made/{n}", 0, region, metric, "%", 10.0, 10.0 + change, change, 100.0, True)
        for n, change in enumerate(changed)
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def printed(changes: pd.DataFrame, metric: str = "total_bad_1", better: str = "lower") -> str:
    console = Console(width=100, file=io.StringIO(), color_system=None)
    for table in terminal(changes, effects(changes, {}), metric, better, "runs/[old]"):  # type: ignore[arg-type]
        console.print(table)
    return console.file.getvalue()  # type: ignore[attr-defined]


def test_cells_stand_by_how_much_they_changed_and_the_mean_with_its_verdict() -> None:
    text = printed(cells(-1, -2, -1.5, -1, -3, -2, -1))
    assert "total_bad_1 (%) in 'all', since runs/[old]" in text
    lines = [line.split() for line in text.splitlines() if line.strip().startswith("mine")]
    assert lines[0] == ["mine", "made/4", "10.00", "7.00", "-3.00"]
    assert lines[-1][:3] == ["mine", "all", "-1.64"]
    assert lines[-1][-1] == "better"
    assert printed(cells(-1, -2, -1.5, -1, -3, -2, -1), better="higher").rstrip().endswith("worse")


def test_what_is_unchanged_is_said_and_other_metrics_are_not_shown() -> None:
    assert "unchanged" in printed(cells(0, 0))
    assert printed(cells(1, metric="avg")) == ""


def test_many_cells_are_cut_and_the_title_says_so() -> None:
    text = printed(cells(*range(MOST + 5)))
    assert f"{MOST} of {MOST + 5} cells" in text
    assert "made/44" in text
    assert "made/2 " not in text
