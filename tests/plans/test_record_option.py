"""What a recording is to hold."""

from matbench.plans.record_option import RecordOption


def test_choices_are_read_and_compared() -> None:
    assert RecordOption.of() == RecordOption(), "without parts, all of them"
    assert RecordOption.of(["slices,passes=10"]) == RecordOption(True, False, False, False, 10)
    assert RecordOption.of(["all"], "9,3,9").rows == (3, 9)
    assert RecordOption.of(["passes"]).passes == 20
    full = RecordOption().at(20)
    assert full.rows == (10,)
    assert full.covers(RecordOption())
    assert full.covers(RecordOption.of(["slices,passes=5"], "10"))
    assert not full.covers(RecordOption(rows=(3,)))
    assert not RecordOption.of(["slices"], "10").covers(full)
