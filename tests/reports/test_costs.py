"""Times and memory: what may be ranked, and what is said."""

import numpy as np
import pandas as pd
from attrs import evolve

from matbench.reports import costs, page, tables, terminal
from matbench.reports.content import Report
from matbench.reports.numbers import Numbers


def _cells(**columns: list[object]) -> pd.DataFrame:
    fixed = {"params": "", "seed": 0, "status": "ok", "threads": 2}
    return pd.DataFrame({**columns, **{key: value for key, value in fixed.items() if key not in columns}})


def _results(cells: pd.DataFrame) -> pd.DataFrame:
    rows = cells[["algorithm", "params", "scene", "seed"]].assign(view="2", region="all", metric="total_bad_1")
    return rows.assign(value=1.0, unit="%", pixels=10)


def test_times_of_two_machines_are_not_ranked() -> None:
    cells = _cells(
        algorithm=["a", "a", "b", "b", "c", "c"],
        scene=["x", "y"] * 3,
        seconds=[1.0, 3.0, 0.1, 0.1, 5.0, 5.0],
        machine=["one", "one", "two", "two", "one", "one"],
    )

    def ranked(cells: pd.DataFrame) -> set[str]:
        rows = tables.summary(_results(cells), cells)
        return set(rows.index[rows["alike"]])

    seconds = tables.summary(_results(cells), cells)["seconds"]
    assert seconds.to_dict() == {"a": 2.0, "b": 0.1, "c": 5.0}
    assert ranked(cells) == {"a", "c"}, "b ran elsewhere, and was not faster"
    assert "4 of 6 cells can be compared" in costs.timing_note(cells)
    mixed = cells.assign(machine=["one", "two", "one", "one", "one", "one"])
    assert ranked(mixed) == {"b", "c"}
    assert np.isnan(tables.summary(_results(mixed), mixed)["seconds"]["a"]), "no mean over machines"
    assert ranked(cells.assign(machine="one", alone=[True, True, True, False, True, True])) == {"a", "c"}
    assert ranked(cells.assign(machine="one", threads=[2, 2, 4, 4, 2, 2])) == {"a", "c"}
    same = cells.assign(machine="one")
    assert costs.timing_note(same) == ""
    assert ranked(same) == ranked(same.drop(columns="machine")) == {"a", "b", "c"}
    printed = terminal.tables(_results(cells), cells)
    assert "another machine" in str(printed[0].caption)


def test_costs_are_those_of_the_printed_tables(report: Report) -> None:
    company = report.cells.assign(alone=[True, True, True, False, True, None], machine="a")
    rows = tables.summary(report.results, company)
    labelled = evolve(report, results=tables.labelled(report.results), cells=tables.labelled(company))
    made = Numbers(labelled, tables.shared(report.results, company))
    shown = {m: seconds for m, (seconds, *_) in made.costs["seconds"].items()}
    assert shown == {m: None if np.isnan(v) else v for m, v in rows["seconds"].items()}
    assert shown["good"] == 0.5
    marked = [entry for entry in made.costs["seconds"].values() if "not ranked" in entry[3:]]
    assert [entry[:3] for entry in marked] == [[1.5, "1.50", tables.NOT_RANKED]], "one ran while others did"
    assert made.costs["peak_mb"]["good"][:2] == [100, "100"]
    assert set(made.costs) == {"seconds", "peak_mb"}, "nobody told what it took of a device"
    html = page.render(evolve(report, cells=company))
    note = costs.timing_note(company).replace(" (*)", "")
    assert f"{note[0].upper()}{note[1:]}" in html
    assert "beside other cells" not in page.render(report)


def test_what_methods_say_of_a_device_is_shown_and_not_ranked(report: Report) -> None:
    told = report.cells.assign(
        device_seconds=np.nan, device_mb=np.where(report.cells["algorithm"] == "good", 512, np.nan)
    )
    labelled = evolve(report, results=tables.labelled(report.results), cells=tables.labelled(told))
    made = Numbers(labelled, tables.shared(report.results, told))
    assert list(made.costs) == ["seconds", "peak_mb", "device_mb"]
    assert made.costs["device_mb"]["good"] == [512, "512", 0]
    assert [entry[0] for method, entry in made.costs["device_mb"].items() if method != "good"].count(None) >= 1
    assert "device memory as told" in page.render(evolve(report, cells=told))
