"""Counters of work that are compared."""

import os
import sys
from pathlib import Path

import pytest

from matbench.bench import counting
from matbench.bench.measuring import Tree
from matbench.errors import UserError


def test_changed_counters_are_told_one_by_one() -> None:
    before, now = {"a": {"passes": 5, "old": 1}}, {"a": {"passes": 6000, "new": 2}}
    assert counting.changes(before, before) == []
    assert counting.changes(before, now) == ["a: new nothing -> 2", "a: old 1 -> nothing", "a: passes 5 -> 6,000"]


@pytest.mark.parametrize("damage", ["missing", "pipe", "{", "[" * 100_000, "large"])
def test_stored_counters_that_are_no_such_file_are_told(damage: str, tmp_path: Path) -> None:
    path = tmp_path / counting.BENCHMARKS / "counters.json"
    path.parent.mkdir(parents=True)
    if damage == "pipe":
        os.mkfifo(path)
    elif damage == "large":
        path.touch()
        os.truncate(path, 1 << 40)
    elif damage != "missing":
        path.write_text(damage)
    with pytest.raises(UserError, match="cannot be read: matbench bench --update writes it"):
        counting.stored(Tree(tmp_path, Path(sys.executable), tmp_path))
