"""What a wait status and a log come to, in words; whole cells that end so are tried in the journeys."""

import os
import signal

import pytest

from matbench.solving import memory
from matbench.solving.child import Log
from matbench.solving.ending import how_it_ended


@pytest.fixture
def log() -> Log:
    read, write = os.pipe()
    os.close(write)
    return Log(read)


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (signal.SIGSEGV, "ended by a signal (segmentation fault, SIGSEGV)"),
        (signal.SIGABRT, "ended by a signal (abort, SIGABRT)"),
        (signal.SIGKILL, "ended by a signal (SIGKILL)"),
        (3 << 8, "ended its process (exit status 3)"),
        (0, "ended its process (exit status 0)"),
    ],
)
def test_a_crash_names_its_signal_or_status(log: Log, status: int, said: str) -> None:
    outcome = how_it_ended(int(status), log, memory.kills_for_memory())
    assert (outcome.status, said in outcome.reason) == ("crashed", True), outcome.reason


def test_memory_that_ran_out_is_no_crash(log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "kills_for_memory", lambda: 8)
    assert how_it_ended(signal.SIGKILL, log, 7).status == "out-of-memory"
    assert how_it_ended(signal.SIGKILL, log, 8).status == "crashed"
    log.first += b"terminate called after throwing an instance of 'std::bad_alloc'"
    assert how_it_ended(signal.SIGABRT, log, 8).status == "out-of-memory"
