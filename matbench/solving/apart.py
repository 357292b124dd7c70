"""A function that runs a method, in a process of its own: it may hang, crash, or leave others behind.

Three processes take part. This one starts a watcher from the fork server. The watcher forks the process that calls the
function, waits for its answer and then kills everything below itself.
"""

import os
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any

from matbench import linux
from matbench.solving import processes
from matbench.solving.watcher import Watcher

_TICK = 0.05  # seconds between two looks at a process
_LOOK = 0.5  # seconds between two looks at its watcher
_ANSWER, _REASON = b"+", b"-"  # how a watcher's message begins
_GRACE = 30.0  # seconds beyond its time that an answer may take to be sent


class NoAnswer(Exception):
    """There is none: why, in a line."""


def call_apart(function: Callable[..., bytes], arguments: tuple[Any, ...], timeout: float) -> bytes:
    """The bytes that a function returns, which a process of its own calls.

    They are not unpickled: the method may have forged them.

    Parameters
    ----------
    timeout
        Seconds that the call may take.

    Raises
    ------
    NoAnswer
        If the process ended without an answer, or the time was up.
    """
    line, theirs = Pipe()
    watcher = Watcher(_watch, (theirs, timeout, function, arguments))
    theirs.close()
    end, is_lost = time.monotonic() + timeout + _GRACE, False
    try:
        while not line.poll(_LOOK):
            if is_lost := watcher.is_stopped() or time.monotonic() > end:
                raise NoAnswer("the process that watches it was stopped, or gives no answer")
        said = line.recv_bytes()
    except (EOFError, OSError) as error:
        raise NoAnswer("the method ended the process that watches it") from error
    finally:
        line.close()
        watcher.end(at_once=is_lost)
    sign, found = said[:1], said[1:]
    if sign != _ANSWER:
        raise NoAnswer(found.decode("utf-8", "replace"))
    return found


def _watch(line: Connection, timeout: float, function: Callable[..., bytes], arguments: tuple[Any, ...]) -> None:
    """The watcher's process: fork a process that calls the function, send its answer, kill all that is left."""
    processes.lead_own_session()  # Ctrl-C is for the process that asked, which then closes the line
    answers, theirs = Pipe(duplex=False)
    watcher, pid = os.getpid(), os.fork()
    if not pid:
        try:
            linux.die_with_parent(watcher)
            for ours in (line, answers):
                ours.close()
            own, found = os.getpid(), function(*arguments)
            if os.getpid() == own:  # else this is a copy that the method has forked, and not the one to answer
                theirs.send_bytes(found)
                os._exit(0)
        finally:
            os._exit(1)
    theirs.close()
    try:
        with suppress(OSError):  # nobody asks any more
            line.send_bytes(_heard(answers, line, pid, timeout))
    finally:
        processes.kill_descendants()


def _heard(answers: Connection, line: Connection, pid: int, timeout: float) -> bytes:
    """The answer of process `pid` behind its sign; else how it ended, or that the time was up."""
    end, sources = time.monotonic() + timeout, [answers, line]
    while time.monotonic() < end:
        # first whether it has ended, then what it sent: so an answer sent just before the end is not missed
        ended = processes.reap().get(pid)
        ready = wait(sources, _TICK if ended is None else 0)
        if line in ready:
            return _REASON + b"nobody wants to know"
        if answers in ready:
            try:
                return _ANSWER + answers.recv_bytes()
            except (EOFError, OSError):
                sources.remove(answers)
        if ended is not None:
            code = os.waitstatus_to_exitcode(ended)
            how = f"signal {-code}" if code < 0 else f"exit status {code}"
            return _REASON + f"the method ended its process ({how})".encode()
    return _REASON + f"no answer within {timeout:g} s".encode()
