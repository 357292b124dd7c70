"""Tables as CSV files."""

import time
from pathlib import Path

import pandas as pd
import pytest

from matbench.files import csv_tables
from matbench.files.csv_tables import EACH_CELL, LARGEST, csv_text, most_bytes, read_csv

COLUMNS = ["algorithm", "metric", "value"]
TABLE = pd.DataFrame({"=a": ["=1+1", "nan", "'", "-x"], "value": [-1.5, 2.0, float("nan"), 3.0], "n": [-1, 0, 1, 2]})


def test_a_table_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(csv_text(TABLE))
    assert path.read_text() == "'=a,value,n\n'=1+1,-1.5,-1\nnan,2.0,0\n',,1\n'-x,3.0,2\n"
    found = read_csv(path, ["=a"], 1 << 20, numbers=True)
    assert list(found["=a"]) == ["=1+1", "nan", "'", "-x"]
    assert list(found["n"]) == [-1, 0, 1, 2]
    assert list(read_csv(path, ["value"], 1 << 20)["value"]) == ["-1.5", "2.0", "", "3.0"]


def test_a_table_that_is_printed_is_inert() -> None:
    assert csv_text(pd.DataFrame({"work": ["\x1b[2J", "\u202egnp"]})) == "work\n\\x1b[2J\n\\u202egnp\n"


def test_two_columns_of_one_name_stay_two() -> None:
    assert csv_text(pd.DataFrame([["=1", "=2"]], columns=["a", "a"])) == "a,a\n'=1,'=2\n"


def refused(path: Path, content: str, words: str) -> None:
    path.write_text(content)
    with pytest.raises(ValueError, match=words):
        read_csv(path, COLUMNS, 1 << 20)


def test_a_table_is_read_as_texts(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('algorithm,metric,value,more\nnan,"a,b",1.10,2\n,b,,\n')
    table = read_csv(path, COLUMNS, 1 << 20)
    assert table.to_numpy().tolist() == [["nan", "a,b", "1.10", "2"], ["", "b", "", ""]]
    assert read_csv(path, ["metric"], 1 << 20)["metric"].tolist() == ["a,b", "b"], "whatever else it holds"
    numbers = read_csv(path, COLUMNS[:2], 1 << 20, numbers=True)
    assert numbers["algorithm"].tolist() == ["nan", ""]


def test_what_is_no_such_table_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    refused(path, "", "no list of columns")
    refused(path, "algorithm,value\n1,2\n", "no column 'metric'")
    refused(path, ",".join(map(str, range(100_000))) + "\n", "no list of columns")
    refused(path, "algorithm,metric,value,value\n", "no list of columns")
    refused(path, "algorithm,metric,value\n" + "\n" * 9, "more lines than fields")
    refused(path, "algorithm,metric,value\n1,2,3,4\n", "more fields than")
    refused(path, "algorithm,metric,value\n1,2," + "3" * 200_000, "no table: field larger")
    refused(path, "algorithm,metric,value\n" + "1,2,3\n" * 200_000, "bytes: 1048576 are possible")
    path.unlink()
    path.symlink_to("/dev/zero")
    with pytest.raises(ValueError, match="is a device"):
        read_csv(path, COLUMNS, 1 << 20)


def test_a_run_of_more_cells_may_have_larger_tables() -> None:
    assert most_bytes(1) < most_bytes(1000) == EACH_CELL * 1004
    assert most_bytes(10**9) == LARGEST


@pytest.mark.parametrize("before", ["", "\n\n"])
def test_a_first_row_of_very_many_fields_is_refused_before_it_is_parsed(tmp_path: Path, before: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text("algorithm,metric,value\n" + before + "1," * 300_000 + "1\n")
    began = time.process_time()
    with pytest.raises(ValueError, match="more fields than"):
        read_csv(path, COLUMNS, 1 << 20)
    assert time.process_time() - began < 1, "pandas takes four seconds"


def test_a_long_table_is_written_in_parts_that_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = csv_text(TABLE)
    for rows in (1, 3, 4):
        monkeypatch.setattr(csv_tables, "_AT_ONCE", rows)
        assert csv_text(TABLE) == whole
        assert csv_text(TABLE.iloc[:0]) == "'=a,value,n\n"
