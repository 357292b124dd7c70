"""What others took while a method was timed."""

import os
import subprocess
import sys
import time

import pytest

from matbench.solving import disturbance
from matbench.solving.disturbance import Moment, Share, between

_SPINS = "import time\nend = time.monotonic() + {}\nwhile time.monotonic() < end: pass"


def test_processor_seconds_are_those_of_the_whole_tree() -> None:
    spins = f"subprocess.run([sys.executable, '-c', {_SPINS.format(0.3)!r}])"
    code = f"import subprocess, sys\n{spins}\nprint(1, flush=True)\ninput()"
    line = [sys.executable, "-c", code]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        taken = disturbance.processor_seconds(process.pid)
        process.communicate("\n")
    assert 0.05 < taken < 2  # what it got of 0.3 s, and two starts of Python


def test_own_seconds_are_not_others() -> None:
    before = disturbance.moment(os.getpid())
    end = time.thread_time() + 0.4
    while time.thread_time() < end:
        pass
    share = between(before, disturbance.moment(os.getpid()))
    assert share.own == pytest.approx(0.4, abs=0.1)
    assert share.wall >= 0.4 - 0.05


@pytest.mark.parametrize(
    ("others", "threads", "disturbed"),
    [(0.0, 2, False), (0.15, 2, False), (0.3, 2, True), (1.0, 2, True), (1.0, 1, False), (1.5, 1, True)],
)
def test_what_is_within_reach_decides(others: float, threads: int, disturbed: bool) -> None:
    # two cores for a second: a solve of one thread can do with one of them
    assert Share(wall=1, own=0.5, others=others, stolen=0).is_disturbed(threads, cores=2) is disturbed
    assert Share(wall=1, own=0.5, others=0, stolen=others).is_disturbed(threads, cores=2) is disturbed


def test_of_a_moment_nobody_can_tell() -> None:
    assert not Share(wall=0.01, own=0, others=1, stolen=0).is_disturbed(2, 2)


def test_a_program_beside_is_seen() -> None:
    with subprocess.Popen([sys.executable, "-c", _SPINS.format(5)]) as beside:
        before = disturbance.moment(os.getpid())
        time.sleep(1)
        share = between(before, disturbance.moment(os.getpid()))
        beside.kill()
    assert share.others > 0.3


def test_rounding_takes_nothing_away() -> None:
    share = between(Moment(0, 10, 1, 5), Moment(1, 10.1, 1, 5.3))
    assert share.others == 0
    assert share.own == pytest.approx(0.3)
