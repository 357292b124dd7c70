"""What became of a cell."""

import pytest

from matbench.runs.outcome import Outcome


@pytest.mark.parametrize(
    ("outcome", "doubtful"),
    [
        (Outcome("ok", 1.0), False),
        (Outcome("ok", 1.0, alone=False), True),
        (Outcome("ok", 1.0, doubt="others took 1 processor seconds of 1 s"), True),
        (Outcome("failed", alone=False), False),  # it has no seconds to compare
    ],
)
def test_seconds_are_in_doubt_where_others_ran(outcome: Outcome, doubtful: bool) -> None:
    assert outcome.is_doubtful is doubtful


def test_a_reason_is_one_line_that_can_be_printed() -> None:
    assert Outcome("failed", reason="one\x1b[2J\n  two\t").reason == "one [2J two"
    assert len(Outcome("failed", reason="x" * 100_000).reason) == 2000
