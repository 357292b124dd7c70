"""How a process that runs methods ends, in words, and its stack before it is killed."""

import os
import signal
import time
from contextlib import suppress
from multiprocessing.connection import wait

from matbench.runs.outcome import Outcome
from matbench.solving import memory, processes
from matbench.solving.child import Child, Log

_TICK = 0.05  # seconds between two looks at a process
_STACK_SECONDS = 0.5  # that a process has to print its stack before it is killed


def how_it_ended(status: int, log: Log, kills: int) -> Outcome:
    """The outcome for a child that ended before it answered, by itself or by the system."""
    code = os.waitstatus_to_exitcode(status)
    if b"std::bad_alloc" in log:  # C++ that meets the memory limit aborts: only its message tells this from a crash
        return Outcome("out-of-memory", reason="the method ended its process: std::bad_alloc")
    if code == -signal.SIGKILL and memory.kills_for_memory() > kills:
        return Outcome("out-of-memory", reason="the system ended the method's process: memory had run out")
    if code >= 0:
        return Outcome("crashed", reason=f"the method ended its process (exit status {code})")
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    words = {"SIGSEGV": "segmentation fault, ", "SIGABRT": "abort, ", "SIGFPE": "arithmetic, "}.get(name, "")
    return Outcome("crashed", reason=f"the method's process was ended by a signal ({words}{name})")


def print_stack(child: Child, log: Log) -> None:
    """Have the child print its stack into the log: SIGABRT makes `faulthandler` do so.

    Whoever reads the log then sees where the method hung, or what took the memory.
    """
    with suppress(ProcessLookupError):
        os.kill(child.pid, signal.SIGABRT)
    end = time.monotonic() + _STACK_SECONDS
    while time.monotonic() < end and child.pid not in processes.reap():
        wait([child.output], _TICK)
        log.drain()
