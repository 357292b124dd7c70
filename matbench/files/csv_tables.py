"""Tables as CSV files: no field is a formula to a spreadsheet, and what was written is read back as it was.

What is read is not trusted: columns are known beforehand, and the size is bounded.
"""

import csv
from collections.abc import Sequence
from io import BytesIO, TextIOWrapper
from pathlib import Path

import numpy as np
import pandas as pd

from matbench.files.plain import read_plain
from matbench.safe_text import csv_field, from_csv_field

_HEAD, _MOST_COLUMNS = 1 << 12, 64  # bytes of the first line; no table has half as many columns
_AT_ONCE = 1 << 16  # rows
_TOO_MANY = "its lines have more fields than its first one has columns"
EACH_CELL, LARGEST = 1 << 18, 1 << 28
"""Bytes of a table: so many for each cell of its run, but no more than so many in all."""


def csv_text(table: pd.DataFrame) -> str:
    """A table as the text of a CSV file, without its index (`matbench.safe_text.csv_field`)."""
    starts = range(0, max(1, len(table)), _AT_ONCE)
    parts = (_mapped(table.iloc[start : start + _AT_ONCE], csv_field) for start in starts)
    # pandas holds a text that it writes in four bytes a character: never all of a long table
    return "".join(
        part.to_csv(index=False, header=not number, lineterminator="\n") for number, part in enumerate(parts)
    )


def most_bytes(cells: int) -> int:
    """Bytes that a table of a run of so many cells may have. One cell makes some twenty kilobytes at most."""
    return min(EACH_CELL * (cells + 4), LARGEST)


def read_csv(path: Path, columns: Sequence[str], most: int, numbers: bool = False) -> pd.DataFrame:
    """A table in a file that is not trusted, as texts; they are as `csv_text` was given them.

    Texts, because a method may be called "nan", and the parser of pandas may change a number's last bit. What was empty
    is an empty text.

    Parameters
    ----------
    columns
        Those that it must have.
    most
        Bytes that the file may have (`most_bytes`).
    numbers
        Let pandas find out which of the other columns hold numbers.

    Raises
    ------
    ValueError
        If it is no plain file, too large, no table, or lacks columns.
    OSError
        If it is missing or cannot be read.
    """
    content = read_plain(path, most=most)
    head = content[:_HEAD].partition(b"\n")[0].decode("utf-8").strip().split(",")
    # the head first: pandas takes kilobytes for each column, and a file may name a million of them
    if head == [""] or len(set(head)) != len(head) or len(head) > _MOST_COLUMNS:
        raise ValueError("its first line is no list of columns")
    if content.count(b"\n") > 1 + content.count(b",") / max(1, len(head) - 1):
        raise ValueError("it has more lines than fields for them")
    if _fields_of_first_row(content) > len(head):
        raise ValueError(_TOO_MANY)
    names = [from_csv_field(name) for name in head]
    if lacking := [name for name in columns if name not in names]:
        raise ValueError(f"it has no column {lacking[0]!r}")
    kinds = {old: str for old, name in zip(head, names, strict=True) if not numbers or name in columns}
    found = pd.read_csv(BytesIO(content), dtype=kinds, keep_default_na=False)
    if not isinstance(found.index, pd.RangeIndex):
        raise ValueError(_TOO_MANY)
    return _mapped(found, from_csv_field)


def _fields_of_first_row(content: bytes) -> int:
    """Fields of the line after the head: pandas makes an index level, slowly, of each that has no column."""
    rows = csv.reader(TextIOWrapper(BytesIO(content), "utf-8", newline=""))
    try:
        next(rows)
        return len(next(filter(None, rows), []))  # an empty line is none
    except csv.Error as error:
        raise ValueError(f"it is no table: {error}") from None


def _mapped(table: pd.DataFrame, change) -> pd.DataFrame:  # type: ignore[no-untyped-def]
    out = table.rename(columns=lambda name: change(name) if isinstance(name, str) else name)
    for place, kind in enumerate(table.dtypes):
        if pd.api.types.is_object_dtype(kind) or pd.api.types.is_string_dtype(kind):
            values = table.iloc[:, place].to_numpy(object)
            # a column repeats few texts: each is looked at once
            changed = {one: change(one) for one in set(values) if isinstance(one, str)}
            out.isetitem(place, np.array([changed.get(one, one) for one in values], object))
    return out
