"""What became of a cell."""

from typing import Any

import pytest
from attrs import evolve

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
    assert Outcome("failed", reason="one\x1b[2J\n  two\t").reason == "one two"
    assert len(Outcome("failed", reason="x" * 100_000).reason) == 2000


@pytest.mark.parametrize(
    ("claim", "words"),
    [
        ({"seconds": 1.7e308}, "seconds = 1.7e+308"),
        ({"seconds": float("inf")}, "seconds = inf"),
        ({"warmup_seconds": float("nan")}, "warmup_seconds = nan"),
        ({"others_seconds": -1.0}, "others_seconds = -1.0"),
        ({"peak_mb": 1e12}, "peak_mb = 1000000000000.0"),
        ({"threads": -3}, "threads = -3"),
        ({"work": {"steps": 10**30}}, "steps = 10^30, about"),
        ({"work": {"steps": -(10**4000)}}, "steps = -10^4000, about"),
        ({"threads": 10**400}, "threads = 10^400, about"),
        ({"history": {"energy": [1.0, None, float("inf")]}}, "energy = inf"),
        ({"seconds": 3e6, "history": {"energy": [-1e30, None]}, "work": {"steps": 2**62}}, ""),
    ],
)
def test_numbers_that_no_solve_gives_are_told(claim: dict[str, Any], words: str) -> None:
    assert evolve(Outcome("ok", 1.0), **claim).implausible == words
