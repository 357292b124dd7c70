"""The process that runs methods, as its keeper sees it: what it prints, and what it says."""

import os
from collections.abc import Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from attrs import evolve

from matbench.plans.plan import Cell, Method
from matbench.plans.settings import Settings
from matbench.runs.outcome import Outcome
from matbench.solving import confinement, intake, processes
from matbench.solving.child import LOG_ENDS, Child, Log
from matbench.solving.worker import Job, Message, Order

JOB = Job(Path("run"), Cell(Method("flat", {}), "synthetic/box", "", 0, "0" * 16), (), 2, Settings(isolation="shared"))


def printed(*pieces: bytes) -> Log:
    """The log of a process that has printed these pieces."""
    ours, theirs = os.pipe()
    os.set_blocking(ours, False)
    log = Log(ours)
    for piece in pieces:
        os.write(theirs, piece)  # a pipe holds as much as LOG_ENDS
        assert log.take()
    assert not log.take(), "nothing is there now"
    os.write(theirs, b"at last")
    os.close(theirs)
    log.drain()
    os.close(ours)
    return log


@pytest.fixture
def child() -> Iterator[tuple[Child, Connection]]:
    ours, theirs = Pipe()
    unused, output = os.pipe()
    made = Child(0, ours, unused, JOB)
    yield made, theirs
    theirs.close()
    os.close(output)
    made.close()


def test_what_is_short_is_kept_whole() -> None:
    log = printed(b"one\n", b"two\n")
    assert log.whole() == b"one\ntwo\nat last"
    assert b"two" in log
    assert b"three" not in log


@pytest.mark.parametrize("pieces", [2, 3, 7])
def test_of_what_is_long_both_ends_are_kept_and_the_rest_is_counted(pieces: int) -> None:
    text = b"".join(b"%07d\n" % number for number in range(pieces * LOG_ENDS // 8))
    log = printed(*(text[at : at + LOG_ENDS] for at in range(0, len(text), LOG_ENDS)))
    text += b"at last"
    gap = len(text) - 2 * LOG_ENDS
    said = f"\n... {gap} bytes left out ...\n".encode()
    assert log.whole() == text[:LOG_ENDS] + said + text[-LOG_ENDS:]


def test_messages_are_lines_that_may_come_in_pieces(child: tuple[Child, Connection]) -> None:
    made, theirs = child
    line = b'{"word": "done", "reason": "", "is_fit": true}\n'
    os.write(theirs.fileno(), b'{"word": "begins"}\n' + line[:9])
    assert made.messages() == [Message("begins")]
    os.write(theirs.fileno(), line[9:20])
    assert made.messages() == []
    os.write(theirs.fileno(), line[20:])
    assert made.messages() == [Message("done", is_fit=True)]
    theirs.close()
    with pytest.raises(EOFError):
        made.messages()


@pytest.mark.parametrize("junk", [b"[]\n", b'{"word": "gives up"}\n', b"\x80\x04N.\n", b"\n"])
def test_what_is_no_message_is_refused(child: tuple[Child, Connection], junk: bytes) -> None:
    made, theirs = child
    os.write(theirs.fileno(), junk)
    with pytest.raises(ValueError, match="no message"):
        made.messages()


def test_no_message_is_without_end(child: tuple[Child, Connection]) -> None:
    made, theirs = child
    os.write(theirs.fileno(), b"x" * LOG_ENDS)
    assert made.messages() == []
    os.write(theirs.fileno(), b"x")
    with pytest.raises(ValueError, match="no message is so long"):
        made.messages()


def test_a_process_suits_jobs_with_the_same_limits_only(child: tuple[Child, Connection]) -> None:
    made, _ = child
    assert made.suits(evolve(JOB, cell=evolve(JOB.cell, seed=1)))
    assert not made.suits(evolve(JOB, threads=1))
    assert not made.suits(evolve(JOB, settings=Settings(isolation="process")))
    assert not made.suits(evolve(JOB, settings=Settings(isolation="shared", memory=64)))


def solved(folder: Path, confined: bool) -> tuple[Outcome, bytes]:
    """What a cell ends as in a process that does not begin to solve it, and what that process printed."""
    ours, inbox = Pipe()
    made = Child.fork(JOB, inbox, confined)
    try:
        made.line.send(Order(JOB, folder / "views.npz", folder))
        assert made.line.poll(60)
        assert made.messages() == [Message("done", is_fit=False)]
        log = Log(made.output)
        log.drain()
    finally:
        made.close()
        os.waitpid(made.pid, 0)
        ours.close()
        inbox.close()
    return intake.outcome(folder), log.first


@pytest.mark.parametrize("confined", [False, True])
def test_what_fails_before_the_method_starts_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, confined: bool
) -> None:
    def refuse(*_: object) -> None:
        raise ValueError("No threading layer could be loaded.")

    where, name = (confinement, "shut_in") if confined else (processes, "use_threads")
    monkeypatch.setattr(where, name, refuse)
    outcome, printed = solved(tmp_path, confined)
    assert (outcome.status, outcome.reason) == (
        "failed",
        f"ValueError: No threading layer could be loaded. (test_child.py:{refuse.__code__.co_firstlineno + 1})",
    )
    assert b"Traceback" in printed
    assert b"No threading layer could be loaded." in printed


def test_a_method_that_cannot_be_shut_in_does_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(confinement, "shut_in", lambda *_: False)
    outcome, _ = solved(tmp_path, True)
    assert outcome.status == "failed"
    assert "could not be shut in" in outcome.reason
