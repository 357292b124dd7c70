"""Counters of work that are compared."""

from matbench.bench import counting


def test_changed_counters_are_told_one_by_one() -> None:
    before, now = {"a": {"passes": 5, "old": 1}}, {"a": {"passes": 6000, "new": 2}}
    assert counting.changes(before, before) == []
    assert counting.changes(before, now) == ["a: new nothing -> 2", "a: old 1 -> nothing", "a: passes 5 -> 6,000"]
