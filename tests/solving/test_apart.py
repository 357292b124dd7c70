"""A function in a process of its own: what it returns, or why it returns nothing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from matbench.solving import apart, processes
from matbench.solving.apart import NoAnswer, call_apart
from matbench.solving.environment import without_main

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="watched by Linux's means")


def answers(value: bytes) -> bytes:
    return value


def forks() -> bytes:
    os.fork()
    return b"once"


def exits() -> bytes:
    os._exit(3)


def ends_by(number: int) -> bytes:
    os.kill(os.getpid(), number)
    time.sleep(600)
    return b""


def raises() -> bytes:
    raise ArithmeticError


def hangs(file: Path) -> bytes:
    file.write_text(str(subprocess.Popen(["sleep", "600"], start_new_session=True).pid))
    time.sleep(600)
    return b""


def to_watcher(number: int) -> bytes:
    os.kill(os.getppid(), number)
    time.sleep(600)
    return b""


def claims_much() -> bytes:
    """Sends the beginning of a message that never ends."""
    for one in range(3, 64):
        try:
            os.write(one, b"\x7f\xff\xff\xff" + b"x" * 100)
        except OSError:
            continue
    time.sleep(600)
    return b""


@pytest.fixture(autouse=True)
def _server() -> None:
    with without_main():
        processes.start_server([])


def asked(function, *arguments: object, timeout: float = 20) -> bytes:
    with without_main():
        return call_apart(function, arguments, timeout)


@pytest.mark.parametrize("value", [b"", b"-", b"\0" * 300_000])
def test_what_it_returns_comes_as_it_is(value: bytes) -> None:
    assert asked(answers, value) == value


def test_a_copy_of_the_process_does_not_answer() -> None:
    assert asked(forks) == b"once"


@pytest.mark.parametrize(
    ("function", "arguments", "said"),
    [
        (exits, (), r"^the method ended its process \(exit status 3\)$"),
        (raises, (), r"^the method ended its process \(exit status 1\)$"),
        (ends_by, (signal.SIGSEGV,), r"^the method ended its process \(signal 11\)$"),
        (to_watcher, (signal.SIGKILL,), "^the method ended the process that watches it$"),
        (to_watcher, (signal.SIGSTOP,), "^the process that watches it was stopped, or gives no answer$"),
    ],
)
def test_why_there_is_no_answer_is_told(function, arguments: tuple[int, ...], said: str) -> None:
    with pytest.raises(NoAnswer, match=said):
        asked(function, *arguments)


def test_what_hangs_is_ended_with_all_that_it_has_started(tmp_path: Path) -> None:
    for seconds in (1, 5, 25):
        with pytest.raises(NoAnswer, match=f"no answer within {seconds} s"):
            asked(hangs, tmp_path / "pid", timeout=seconds)
        if (tmp_path / "pid").exists():  # on a busy machine, it may not have come so far
            break
    assert not psutil.pid_exists(int((tmp_path / "pid").read_text()))


def test_a_message_that_never_ends_is_not_awaited_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "_GRACE", 0.5)
    with pytest.raises(NoAnswer):
        asked(claims_much, timeout=1)
