"""Errands of a keeper that need the truth of a scene: each in a process that runs nothing of a method."""

import os
import signal
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import NoReturn

from matbench import linux
from matbench.errors import failure


class Late(Exception):
    """An errand that did not end in time."""


def run(errand: Callable[[], None], inbox: Connection, end: float | None) -> str:
    """Have a process below this one do something; what went wrong, as ``TypeOfError: message``, else nothing.

    Parameters
    ----------
    inbox
        The keeper's line: whatever comes there means that nobody wants the cell any more.
    end
        When to give up, by `time.monotonic`; None for never.

    Raises
    ------
    EOFError
        If the keeper is dismissed meanwhile.
    Late
        If it did not end in time.
    """
    line, theirs = Pipe(duplex=False)
    keeper, pid = os.getpid(), os.fork()
    if not pid:
        _do(errand, keeper, theirs)
    theirs.close()
    try:
        ready = wait([line, inbox], None if end is None else max(0.0, end - time.monotonic()))
        if inbox in ready:
            raise EOFError
        if not ready:
            raise Late
        with suppress(EOFError):  # it ended without a word
            return line.recv_bytes().decode("utf-8", "replace")
        return "RuntimeError: the process that reads scenes has ended"
    finally:
        line.close()
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        with suppress(ChildProcessError):  # `processes.reap` may have been there before
            os.waitpid(pid, 0)


def _do(errand: Callable[[], None], keeper: int, line: Connection) -> NoReturn:
    """Run the errand and tell how it ended, in the new process."""
    said = "RuntimeError: the process that reads scenes has ended"
    try:
        os.setsid()
        linux.die_with_parent(keeper)
        linux.keep_private()
        errand()
        said = ""
    except BaseException as error:  # whatever a dataset raises, SystemExit included
        traceback.print_exc()
        said = failure(error)
    finally:
        with suppress(OSError):
            line.send_bytes(said.encode("utf-8", "replace"))
        os._exit(0)  # nothing of what the keeper has registered for its own end
