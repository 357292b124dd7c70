"""What happens in a process forked from this one: for whatever a process does to itself."""

import json
import os
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any


def in_child(act: Callable[[], Any]) -> Any:
    """What a function returns in a process of its own, by way of JSON; it must return."""
    ours, theirs = os.pipe()
    pid = os.fork()
    if not pid:
        try:
            os.close(ours)
            os.write(theirs, json.dumps(act()).encode())
            os._exit(0)
        except BaseException:  # a test's process must not go on here
            traceback.print_exc()
        finally:
            os._exit(1)
    os.close(theirs)
    with os.fdopen(ours, "rb") as line:
        said = line.read()
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0, "what it raised is printed above"
    return json.loads(said)


@contextmanager
def beside(act: Callable[[], Any]) -> Iterator[tuple[int, Any]]:
    """A process that has done something and then rests as long as the block lasts: its id and what it returned."""
    ours, theirs = os.pipe()
    mine, its = os.pipe()
    pid = os.fork()
    if not pid:
        try:
            os.close(ours)
            os.close(its)
            os.write(theirs, json.dumps(act()).encode() + b"\n")
            os.read(mine, 1)  # until the block ends
            os._exit(0)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(1)
    os.close(theirs)
    os.close(mine)
    try:
        with os.fdopen(ours, "rb") as line:
            said = line.readline()
            assert said, "what it raised is printed above"
            yield pid, json.loads(said)
    finally:
        os.close(its)
        with suppress(ChildProcessError):
            os.waitpid(pid, 0)
