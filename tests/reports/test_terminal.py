"""The terminal's tables where more is better, and where there is little room."""

import io

import pandas as pd
from rich.console import Console

from matbench.reports import tables, terminal

REGIONS = ("nonocc", "all", "occ", "disc", "textureless")


def run_of(
    metric: str, values: dict[str, float], regions: tuple[str, ...] = REGIONS
) -> tuple[pd.DataFrame, pd.DataFrame]:
    rows = [
        (method, "", "synthetic/box", "2", 0, region, name, value, "%" if name == metric else "px", 9)
        for method, value in values.items()
        for region in regions
        for name in (metric, "avg")
    ]
    columns = ["algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels"]
    cells = [(method, "", "synthetic/box", 0, "ok", 1.25, 10.0, "") for method in values]
    heads = ["algorithm", "params", "scene", "seed", "status", "seconds", "peak_mb", "reason"]
    return pd.DataFrame(rows, columns=columns), pd.DataFrame(cells, columns=heads)


def printed(width: int, *args: object) -> str:
    console = Console(width=width, record=True, file=io.StringIO())
    for table in terminal.tables(*args, width):  # type: ignore[arg-type]
        console.print(table)
    return console.export_text()


def test_where_more_is_better_the_largest_comes_first() -> None:
    results, cells = run_of("good_1", {"low": 97.46, "high": 98.86})
    assert tables.summary(results, cells, "good_1", better="higher").index.tolist() == ["high", "low"]
    assert tables.summary(results, cells, "good_1").index.tolist() == ["low", "high"]
    text = printed(80, results, cells, "good_1", "higher")
    assert text.index("98.86") < text.index("97.46")


def test_where_zero_is_best_the_smallest_by_magnitude_comes_first() -> None:
    results, cells = run_of("bias", {"far": -0.9, "near": 0.4, "right": -0.1})
    assert tables.summary(results, cells, "bias", better="zero").index.tolist() == ["right", "near", "far"]
    assert tables.summary(results, cells, "bias").index.tolist() == ["far", "right", "near"]


def test_a_narrow_terminal_keeps_methods_and_times() -> None:
    results, cells = run_of("total_bad_1", {"materiality": 1.5, "okutomi_kanade": 2.5})
    wide, narrow = printed(80, results, cells, "total_bad_1", False), printed(60, results, cells, "total_bad_1", False)
    for name in ("materiality", "okutomi_kanade", "1.25"):
        assert name in wide
        assert name in narrow
    assert "disc" in wide
    assert "disc" not in narrow


def test_no_number_is_cut_off_where_numbers_are_wide() -> None:
    results, cells = run_of("bad_1", {f"method_{number}": 100.0 for number in range(12)})
    results.loc[results["metric"] == "avg", "value"] = 5.7e36
    cells["doubt"] = "others took 1.2 processor seconds of 0.9 s"
    for width in (80, 100):
        lines = printed(width, results, cells, "bad_1").splitlines()
        assert sum("5.7e+36" in line and line.rstrip().endswith("1.25*") for line in lines) == 12, width


def test_names_of_methods_are_not_broken_in_80_columns() -> None:
    results, cells = run_of("total_bad_1", {"voxel_coloring": 56.02, "mine[share=0.25]": 89.29})
    text = printed(80, results, cells.assign(doubt="others took 1 processor seconds of 1 s"), "total_bad_1")
    assert "voxel_coloring " in text.split("in 'all'")[0]
    assert "mine[share=0.25] " in text.split("in 'all'")[0]


def test_heads_of_methods_are_whole_or_numbers() -> None:
    """The methods of a newcomer's first run, side by side: a name that is cut off is no name."""
    names = [
        "materiality",
        "multiview_sgm",
        "guided_filter",
        "sgbm",
        "kang_szeliski",
        "okutomi_kanade",
        "voxel_coloring",
    ]
    text = printed(80, *run_of("total_bad_1", {name: 10.0 + place for place, name in enumerate(names)}))
    by_scene = text.partition("scene by scene")[2]
    parts = {part for name in names for part in name.split("_")}
    assert "#1" in by_scene or all(part in by_scene for part in parts)


def test_regions_over_all_views_have_a_table_of_their_own() -> None:
    values = {"materiality": 1.5, "okutomi_kanade": 2.5}
    run = run_of("total_bad_1", values, (*REGIONS, *tables.VIEWS))
    text = printed(80, *run, "total_bad_1", False)
    assert "by the views that see a point" in text
    assert "occluded" in text
    assert max(map(len, text.splitlines())) <= 80
    assert "by the views" not in printed(80, *run_of("total_bad_1", values), "total_bad_1", False)
    assert list(tables.summary(*run).columns[:9]) == [f"total_bad_1 {r}" for r in (*REGIONS, *tables.VIEWS)]


def test_cells_that_fail_alike_share_a_row() -> None:
    names = ["algorithm", "params", "scene", "seed", "status", "seconds", "peak_mb", "reason"]
    rows = [
        ("raises", "", f"synthetic/s{k}", 0, "failed", None, None, f"no digits (log: cells/{k:016x}/log.txt)")
        for k in range(9)
    ]
    cells = pd.DataFrame([*rows, ("slow", "", "synthetic/s1", 0, "timeout", None, None, "")], columns=names)
    results = pd.DataFrame(columns=["algorithm", "params", "scene", "region", "metric", "value", "unit"])
    console = Console(width=80, file=io.StringIO(), record=True)
    console.print(terminal.tables(results, cells)[-1])
    text = console.export_text()
    assert "10 cells without a score" in text
    assert "and 6 more" in text
    assert text.count("no digits") == 1
    assert "cells/0000000000000000/log.txt" in "".join(text.split()), "that of the first"
    assert "timeout" in text


def test_further_metrics_and_regions_of_the_scenes_own_have_tables() -> None:
    results, cells = run_of("good_1", {"low": 97.46, "high": 98.86}, (*REGIONS, "planes"))
    text = printed(80, results, cells, "good_1", "higher")
    assert "by the scenes' own regions" in " ".join(text.split())
    assert "by metric" not in text, "there is one metric only"
    console = Console(width=80, file=io.StringIO())
    for table in terminal.tables(results, cells, "good_1", "higher", 80, {"avg": "lower", "not_there": "lower"}):
        console.print(table)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    rows = text[text.index("by metric, in 'all'") :].splitlines()
    assert next(line for line in rows if line.strip().startswith("high")).split() == ["high", "98.86", "98.86"]
    assert "not" not in text.split("by metric")[1].split("scene by scene")[0]
