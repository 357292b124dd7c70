"""Processes that methods have left are found by their mark or their parent; those of others are left alone."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import psutil
import pytest

from matbench.solving import processes, strays

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="found by what Linux shows of processes")


@contextmanager
def sleeping(mark: str | None, session: bool = True) -> Iterator[subprocess.Popen[bytes]]:
    environment = {**os.environ, **({} if mark is None else {processes.MARK: mark})}
    with subprocess.Popen(["sleep", "600"], env=environment, start_new_session=session) as process:
        try:
            yield process
        finally:
            process.kill()


def ended() -> str:
    """The mark of a process that has ended."""
    with subprocess.Popen(["sleep", "600"]) as process:
        mark = f"{process.pid}-{processes.begin_of(process.pid)}"
        process.kill()
    return mark


def test_what_the_dead_have_started_is_ended_and_nothing_else() -> None:
    own = processes.own_mark()
    with ExitStack() as stack:
        left = [stack.enter_context(sleeping(mark)) for mark in (ended(), f"{os.getpid()}-1", "nonsense", "99999999-5")]
        others = [stack.enter_context(sleeping(mark)) for mark in (own, None, "")]
        strays.end_of_the_dead()
        assert not any(psutil.pid_exists(process.pid) for process in left)
        assert [process.poll() for process in others] == [None] * 3


def test_what_is_left_of_this_process_is_ended_unless_a_watcher_is_above_it() -> None:
    own = processes.own_mark()
    with ExitStack() as stack:
        left, watcher = (stack.enter_context(sleeping(own)) for _ in range(2))
        same_session, other = stack.enter_context(sleeping(own, session=False)), stack.enter_context(sleeping(ended()))
        below = ["sh", "-c", "sleep 600 & wait"]
        environment = {**os.environ, processes.MARK: own}
        parent = stack.enter_context(subprocess.Popen(below, env=environment, start_new_session=True))
        stack.callback(parent.kill)
        while not psutil.Process(parent.pid).children():
            time.sleep(0.01)
        strays.end_left({watcher.pid, parent.pid})
        assert not psutil.pid_exists(left.pid)
        assert [process.poll() for process in (watcher, same_session, other, parent)] == [None] * 4
        assert psutil.Process(parent.pid).children()
        strays.end_left({watcher.pid})
        assert not psutil.pid_exists(parent.pid)
        assert watcher.poll() is None


def test_a_process_whose_number_is_used_again_is_another_one() -> None:
    pid, begin = os.getpid(), processes.begin_of(os.getpid())
    assert begin.isdecimal()
    assert processes.own_mark() == f"{pid}-{begin}"
    with subprocess.Popen(["true"]) as process:
        time.sleep(0.2)
        assert processes.begin_of(process.pid) == "", "it has ended, though nobody has waited for it"
