"""The ablation's table in every format: the same numbers."""

from math import nan
from pathlib import Path

import pandas as pd
from latex import compile_latex

from matbench.reports import switches
from matbench.results.ablation import COLUMNS


def table() -> pd.DataFrame:
    rows = [
        (
            "m",
            "pairs",
            "all",
            "some_x&50%",
            region,
            "total_bad_1",
            "%",
            -1.234,
            -2.0,
            -0.5,
            -1.5,
            8,
            0.01,
            "lower",
            nan,
            100.0,
        )
        for region in ("nonocc", "all", "occ")
    ]
    rows += [
        (
            "m",
            "pairs",
            "all",
            "some_x&50%",
            "all",
            "avg",
            "px",
            0.5,
            nan,
            nan,
            nan,
            1,
            0.5,
            "x",
            nan,
            100.0,
        )
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def test_the_lines_are_those_of_one_metric() -> None:
    lines = switches.lines(table())
    assert lines.region.tolist() == ["nonocc", "all", "occ"]
    assert lines.loc[0, ["switch", "change", "interval"]].tolist() == [
        "pairs all → some_x&50%",
        "-1.23",
        "-2.00 .. -0.50",
    ]
    assert switches.lines(table(), "avg").interval.tolist() == ["–"]


def test_latex_has_the_same_numbers_and_no_bare_marks() -> None:
    text = switches.latex(table())
    assert text.count("$-$1.23 & $-$2.00 .. $-$0.50 & 8 & lower") == 3
    assert text.count(r"pairs all $\to$ some\_x\&50\% &") == 3
    assert "→" not in text


def test_latex_compiles(tmp_path: Path) -> None:
    compile_latex(switches.latex(table()), tmp_path)


def test_the_forest_has_a_line_per_region() -> None:
    figure = switches.forest(table())
    assert figure is not None
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == [
        "pairs all → some_x&50%, nonocc",
        "pairs all → some_x&50%, all",
        "pairs all → some_x&50%, occ",
    ]
    assert switches.forest(table().iloc[:0]) is None
