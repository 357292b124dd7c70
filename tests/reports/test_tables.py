"""Means are over what is shared, and nothing that failed is averaged away."""

import io

import numpy as np
import pandas as pd
import pytest
from attrs import evolve
from rich.console import Console

from matbench.reports import tables, terminal
from matbench.reports.content import Report

GOOD, BROKEN = "good", "broken[x=[1] \"'&]"


def test_a_method_that_lacks_a_scene_is_not_ranked(report: Report) -> None:
    rows = tables.summary(report.results, report.cells)
    assert list(rows.index[:1]) == [GOOD]
    assert rows["ranked"].to_dict()[BROKEN] is False
    assert list(rows["ranked"]) == [True, True, False]
    assert list(rows["scenes"]) == [2, 2, 1]
    assert list(rows["asked"]) == [2, 2, 2]
    # score(): 10 for the method, 0 and 1 for the scenes, 0 for `all`, 0.01 for total_bad_1
    assert rows.loc[GOOD, "total_bad_1 all"] == pytest.approx(10.51)
    assert rows.loc[BROKEN, "total_bad_1 all"] == pytest.approx(30.01)
    assert rows.loc[GOOD, "seconds"] == 0.5


def test_means_are_over_the_scenes_that_are_shared(report: Report) -> None:
    """Each of two methods fails on another scene of three: they are compared on the third."""
    scenes = ("s1", "s2", "s3")
    cells = [
        (a, "", s, 0, "failed" if (a, s) in {("a", "s1"), ("b", "s2")} else "ok", 1.0) for a in "ab" for s in scenes
    ]
    ok = [c for c in cells if c[4] == "ok"]
    values = {"s1": 100.0, "s2": 50.0, "s3": 3.0}
    results = pd.DataFrame(
        [(a, "", s, "v", 0, "all", "total_bad_1", values[s], "%", 9) for a, _, s, *_ in ok],
        columns=report.results.columns,
    )
    frame = pd.DataFrame(cells, columns=["algorithm", "params", "scene", "seed", "status", "seconds"])
    assert tables.shared(results, frame).scenes == ("s3",)
    rows = tables.summary(results, frame)
    assert list(rows["total_bad_1 all"]) == [3.0, 3.0]
    assert list(rows["scenes"]) == [1, 1]
    assert set(rows["asked"]) == {3}


def test_nothing_shared_ranks_nobody(report: Report) -> None:
    cells = pd.DataFrame(
        [("a", "", "s1", 0, "ok", 1.0), ("b", "", "s2", 0, "ok", 1.0)],
        columns=["algorithm", "params", "scene", "seed", "status", "seconds"],
    )
    results = pd.DataFrame(
        [(a, "", s, "v", 0, "all", "total_bad_1", 1.0, "%", 9) for a, s in (("a", "s1"), ("b", "s2"))],
        columns=report.results.columns,
    )
    assert not tables.summary(results, cells)["ranked"].any()


def test_one_failed_seed_takes_the_scene_away(report: Report) -> None:
    cells = pd.concat([report.cells, report.cells.iloc[[0]].assign(seed=1, status="crashed")])
    scope = tables.shared(report.results, cells)
    assert "made/one" not in scope.has[GOOD]


def test_a_value_that_is_missing_is_not_averaged_away(report: Report) -> None:
    results = report.results.copy()
    hit = (results["algorithm"] == "good") & (results["scene"] == "made/one") & (results["region"] == "occ")
    results.loc[hit, "value"] = np.nan
    scope = tables.shared(results, report.cells)
    assert np.isnan(tables.means(results, scope, "occ", "avg")[GOOD])
    # where no method has a value the region is empty: its scene does not count
    results.loc[(results["scene"] == "made/one") & (results["region"] == "occ"), "value"] = np.nan
    assert tables.means(results, scope, "occ", "total_bad_1")[GOOD] == pytest.approx(11.21)


def test_per_scene_is_the_mean_over_seeds(report: Report) -> None:
    again = report.results.assign(seed=1, value=report.results["value"] + 2)
    table = tables.per_scene(pd.concat([report.results, again]), "all", "total_bad_1")
    assert table.loc["made/one", GOOD] == pytest.approx(11.01)
    assert np.isnan(table.iloc[1][BROKEN])


def test_read_back_from_a_file(report: Report) -> None:
    def through_csv(frame: pd.DataFrame) -> pd.DataFrame:
        return pd.read_csv(io.StringIO(frame.to_csv(index=False)))

    rows = tables.summary(report.results, report.cells)
    pd.testing.assert_frame_equal(rows, tables.summary(through_csv(report.results), through_csv(report.cells)))


def test_places_go_by_what_is_shown() -> None:
    values = pd.Series({"a": 1.001, "b": 1.002, "c": 2.0, "d": np.nan})
    assert tables.places(values, "%").to_dict() == {"a": 1, "b": 1, "c": 0, "d": 0}
    assert tables.places(values, "%", better="higher").to_dict() == {"a": 2, "b": 2, "c": 1, "d": 0}
    signed = pd.Series({"a": -0.5, "b": 0.5, "c": -3.0, "d": 0.1})
    assert tables.places(signed, "px", better="zero").to_dict() == {"a": 2, "b": 2, "c": 0, "d": 1}
    assert not tables.places(values[["a", "b"]], "%").any()


@pytest.mark.parametrize("width", [80, 140])
def test_terminal(report: Report, width: int) -> None:
    out = io.StringIO()
    for table in terminal.tables(report.results, report.cells):
        Console(file=out, width=width).print(table)
    text = out.getvalue()
    assert max(map(len, text.splitlines())) <= width
    assert "[x=[1]" in text.replace("\n", "")
    for wanted in ("10.51", "not ranked", "failed", "too few scenes", "ValueError"):
        assert wanted in text


def test_terminal_says_nothing_about_nothing(report: Report) -> None:
    assert terminal.tables(report.results.iloc[:0], report.cells.iloc[:0]) == []
    (failures,) = terminal.tables(report.results.iloc[:0], report.cells)
    assert str(failures.title) == "1 cell without a score"


def test_one_scene_in_many_guises_is_one_witness(report: Report) -> None:
    scope = tables.shared(report.results, report.cells)
    assert scope.distinct == len(scope.scenes) == 2
    guises = evolve(scope, scenes=tuple(f"made/one[noise={k}]" for k in range(8)))
    assert guises.distinct == 1


def test_all_tables_at_once_are_those_made_alone(report: Report) -> None:
    again = pd.concat([report.results, report.results.iloc[:40].assign(seed=1, value=np.nan)])
    for (metric, region), table in tables.every_scene(again).items():
        pd.testing.assert_frame_equal(table, tables.per_scene(again, region, metric), check_names=False)


@pytest.mark.parametrize("seed", range(5))
def test_means_over_scenes_are_those_that_pandas_makes(seed: int) -> None:
    random = np.random.default_rng(seed)
    scenes, methods = tuple(f"s{k}" for k in range(9)), ("a", "b", "c")
    table = pd.DataFrame(random.normal(size=(9, 3)), index=list(scenes), columns=list(methods))
    table = table.where(random.random((9, 3)) > 0.1)
    table.loc["s4"] = np.nan
    has = {m: frozenset(s for s in scenes if random.random() > 0.2) for m in methods}
    scope = tables.Shared(methods, scenes, has, tuple(s for s in scenes if all(s in of for of in has.values())))
    filled = table.notna().any(axis=1)
    twin = {m: table.loc[[s for s in scope.counted(m) if filled[s]], m].mean(skipna=False) for m in methods}
    pd.testing.assert_series_equal(
        tables.over_scenes(table[::-1], scope), pd.Series(twin), check_exact=True, check_index_type=False
    )


def test_a_mixture_weighs_every_scene_the_same_and_says_so(report: Report) -> None:
    values = {
        "synthetic/world-7": 8.0,
        "synthetic/world-thin-1": 2.0,
        "synthetic/world-thin-2[n=5]": 4.0,
        "mine/x": 0.0,
    }
    results = pd.DataFrame(
        [
            (a, "", s, "v", 0, "all", "total_bad_1", k + v, "%", 9)
            for k, a in enumerate("ab")
            for s, v in values.items()
        ],
        columns=report.results.columns,
    )
    cells = pd.DataFrame(
        [(a, "", s, 0, "ok", 1.0) for a in "ab" for s in values],
        columns=["algorithm", "params", "scene", "seed", "status", "seconds"],
    )
    assert tables.summary(results, cells)["total_bad_1 all"].to_dict() == {"a": 3.5, "b": 4.5}
    told = "synthetic/world 1, synthetic/world-thin 2, mine 1"
    assert tables.shared(results, cells).mixture == told
    console = Console(file=io.StringIO(), width=200)
    for table in terminal.tables(results, cells):
        console.print(table)
    said = " ".join(console.file.getvalue().split())  # type: ignore[attr-defined]
    assert f"mean over 4 of 4 scenes ({told})" in said
    thin = results[results["scene"].str.contains("thin")]
    assert tables.shared(thin, cells[cells["scene"].str.contains("thin")]).mixture == "", "all are of one family"
