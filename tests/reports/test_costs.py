"""Times and memory: what may be ranked, and what is said."""

import numpy as np
import pandas as pd

from matbench.reports import costs, tables, terminal


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
    assert "of 4 of 6 cells" in costs.timing_note(cells)
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
