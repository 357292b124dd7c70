"""What a keeper makes of its counts of a solve."""

import os

import pytest

from matbench.runs.outcome import Outcome
from matbench.solving.disturbance import Moment
from matbench.solving.stopwatch import Stopwatch


def moment(clock: float, busy: float, own: float) -> Moment:
    return Moment(clock=clock, busy=busy, stolen=0.0, own=own)


def stopped(others: float = 0.0) -> Stopwatch:
    """One second of warm-up and two of a solve that uses one processor; others take `others` seconds in the latter."""
    return Stopwatch(1, moment(0, 0, 0), moment(1, 1, 1), moment(3, 3 + others, 3), peak_mb=70.0)


def test_seconds_memory_and_what_others_took() -> None:
    found = stopped(0.5).timed(Outcome("ok", seconds=2.01, peak_mb=60.0), threads=1)
    assert (found.seconds, found.peak_mb, found.processor_seconds, found.others_seconds) == (2.01, 70.0, 2.0, 0.5)
    assert found.doubt == ""
    assert stopped().timed(Outcome("ok", seconds=2.0, peak_mb=90.0), threads=1).peak_mb == 90.0


def test_what_others_took_is_doubt() -> None:
    doubt = stopped(1000.0).timed(Outcome("ok", seconds=2.0), threads=1).doubt
    assert doubt == "others took 1e+03 processor seconds meanwhile"


def test_the_clock_of_the_process_is_not_believed_alone() -> None:
    found = stopped().timed(Outcome("ok", seconds=0.1), threads=1)
    assert found.seconds == 2
    assert found.doubt == "its process counted 0.1 s, its keeper 2 s"


def test_what_was_not_timed_is_refused() -> None:
    watch = Stopwatch(os.getpid())
    watch.begin_warm_up()
    with pytest.raises(ValueError, match="not timed"):
        watch.timed(Outcome("ok", seconds=2.0), threads=1)
    with pytest.raises(ValueError, match="ends twice"):
        watch.take("ends")
    watch.take_memory(50.0)
    watch.take("begins")
    watch.take_memory(20.0)
    with pytest.raises(ValueError, match="begins twice"):
        watch.take("begins")
    watch.take("ends")
    watch.take_memory(90.0)
    assert watch.peak_mb == 20.0, "before and after the solve nothing is counted"
    with pytest.raises(ValueError, match="ends twice"):
        watch.take("ends")


def test_of_answers_that_were_found_elsewhere_nothing_is_counted() -> None:
    found = Stopwatch(1).timed(Outcome("ok", seconds=2.0, peak_mb=3.0, elsewhere=True), threads=1)
    assert (found.peak_mb, found.processor_seconds) == (None, None)
    assert found.doubt == "its answers were found elsewhere"
