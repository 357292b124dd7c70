"""What a cluster sends to its client may hold values and errors, and nothing that runs.

Dask unpickles much of what it is sent: results, errors, events, the types of results. A pickle names the functions
that are called when it is read. Python tells of each name before it is looked up (an audit event), whichever library
reads the pickle, and a name that is not known to be harmless is refused there.
"""

import builtins
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread, current_thread
from threading import enumerate as enumerate_threads
from typing import Any

_VALUES = {"bytes", "bytearray", "str", "int", "float", "bool", "tuple", "list", "dict", "set", "frozenset", "object"}
_ERRORS = {
    ("tblib.pickling_support", "unpickle_exception"),
    ("tblib.pickling_support", "unpickle_exception_with_attrs"),
    ("distributed.scheduler", "KilledWorker"),
    ("distributed.scheduler", "NoValidWorkerError"),
    ("distributed.scheduler", "NoWorkerError"),
    ("distributed.scheduler", "WorkerState"),
    ("distributed.core", "Status"),
    ("collections", "deque"),
    ("collections", "defaultdict"),
}
"""How Dask wraps errors, and its own errors with what they hold: values, and functions that fill classes with them."""
_LOOP, _HELPERS = "IO loop", "Dask-Offload"
"""Names of the threads in which Dask reads: each client's own, and those where all clients read what is large."""

_guards: list[tuple[set[Thread], list[str]]] = []  # the threads that were there before, and what was refused
_watching: list[bool] = []


class Refused(TypeError):
    """Something that would have run was sent. A TypeError, because Dask then goes without what it could not read."""


@contextmanager
def data_only() -> Iterator[list[str]]:
    """Refuse all that runs in what a Dask client unpickles that is started inside; the names refused, as they come.

    Where the stack of a far error is refused, it is only left out: that is no attack.
    """
    if not _watching:  # once: Python can never be told to stop
        _watching.append(True)
        sys.addaudithook(_hear)
    guard: tuple[set[Thread], list[str]] = set(enumerate_threads()), []
    _guards.append(guard)
    try:
        yield guard[1]
    finally:
        _guards.remove(guard)


def is_guarded() -> bool:
    """Is this thread one in which nothing that runs is unpickled?"""
    return bool(_here())


def _here() -> list[list[str]]:
    """Where to note what is refused in this thread; nothing if it is not guarded."""
    thread = current_thread()
    if thread.name.startswith(_HELPERS):
        return [refused for _, refused in _guards]
    return [refused for before, refused in _guards if thread.name == _LOOP and thread not in before]


def _hear(event: str, args: tuple[Any, ...]) -> None:
    if event != "pickle.find_class" or not _guards:
        return
    notes = _here()
    module, name = map(str, args)
    if not notes or _is_harmless(module, name):
        return
    if module.partition(".")[0] != "tblib":
        for refused in notes:
            refused.append(f"{module}.{name}")
    raise Refused(f"{module}.{name} was sent, which is no data: it was not run")


def _is_harmless(module: str, name: str) -> bool:
    if module == "builtins":
        found = getattr(builtins, name, None)
        return name in _VALUES or (isinstance(found, type) and issubclass(found, BaseException))
    return (module, name) in _ERRORS
