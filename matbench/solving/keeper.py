"""Keepers: processes that run no method themselves but watch the process that does.

For each cell a keeper forks a child process that runs the method. The keeper stores what the child
prints, and measures its time and memory. A child that exceeds a limit is killed with all that it has
started. The keeper owns the cell's folder, so log and outcome are written whatever the method does.

A keeper is connected to the run by a pipe, its line. When the other end of the line closes, even because
the run was killed, the keeper kills everything below it and ends. So nothing outlives a run.
"""

import json
import os
import shutil
import signal
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

from attrs import define, evolve, field

from matbench.runs.store import Outcome, Store, write_cell
from matbench.solving import processes
from matbench.solving.worker import Job, serve

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerProcess

LOG_ENDS = 1 << 16  # bytes kept of the beginning, and of the end, of a cell's output: a method may print without end
_TICK = 0.05  # seconds between two looks at a process
_TREE_LOOKS = 10  # every tenth look includes the processes that it started: these take longer to find and to measure
_STACK_SECONDS = 0.5  # that a process has to print its stack before it is killed
_PATIENCE = 5.0  # seconds that a dismissed keeper has to end its processes


class Dismissed(Exception):
    """Nobody holds the other end of the keeper's line any more."""


@define
class Log:
    """The first and the last `LOG_ENDS` bytes that a process prints.

    Parameters
    ----------
    source
        The file descriptor to read, not blocking.
    left_out
        How many bytes between the two were dropped.
    """

    source: int
    first: bytearray = field(factory=bytearray)
    last: bytearray = field(factory=bytearray)
    left_out: int = 0

    def take(self) -> bool:
        """Read what is there now; False if that is nothing."""
        try:
            found = os.read(self.source, LOG_ENDS)
        except BlockingIOError:
            return False
        room = LOG_ENDS - len(self.first)
        self.first += found[:room]
        self.last += found[room:]
        beyond = max(0, len(self.last) - LOG_ENDS)
        del self.last[:beyond]
        self.left_out += beyond
        return bool(found)

    def drain(self) -> None:
        """Read what is left in the pipe."""
        for _ in range(64):  # a process that has escaped may go on printing: not for ever
            if not self.take():
                return

    def whole(self) -> bytes:
        gap = f"\n... {self.left_out} bytes left out ...\n".encode() if self.left_out else b""
        return bytes(self.first) + gap + bytes(self.last)

    def __contains__(self, words: bytes) -> bool:
        return words in self.first or words in self.last


@define
class Child:
    """The process that runs methods, as its keeper sees it.

    Parameters
    ----------
    line
        The pipe for jobs and answers.
    output
        The file descriptor of what it prints.
    first
        The job by whose settings it is confined.
    is_fit
        May it solve another cell? It says so itself.
    heard
        The part of an answer that has come so far. A method may write anything into this pipe by mistake.
        So answers are lines of JSON, never pickles, and the keeper reads what is there and never waits
        for more.
    """

    pid: int
    line: Connection
    output: int
    first: Job
    is_fit: bool = True
    heard: bytearray = field(factory=bytearray)

    @classmethod
    def fork(cls, job: Job, inbox: Connection) -> "Child":
        """Start a child that solves the cells sent to it. In the child this never returns.

        It is forked from the keeper, which has the libraries loaded already and runs one thread only.
        """
        line, theirs = Pipe()
        output, printed = os.pipe()
        keeper = os.getpid()
        pid = os.fork()
        if not pid:
            try:
                os.setsid()  # a method that signals its process group must not reach the keeper
                processes.die_with_parent(keeper)
                # an end that stayed open here would keep the pipe alive when the keeper or the run has gone
                for ours in (inbox, line):
                    ours.close()
                os.close(output)
                serve(theirs, printed, job)
            finally:
                os._exit(1)  # never back into the keeper's own code, a copy of which this process has
        theirs.close()
        os.close(printed)
        os.set_blocking(output, False)
        return cls(pid, line, output, job)

    def suits(self, job: Job) -> bool:
        """May another job be solved here: is its isolation "shared", with the same threads and memory limit?"""
        first = self.first
        same = (job.threads, job.settings.memory_each()) == (first.threads, first.settings.memory_each())
        return same and job.settings.isolation == "shared"

    def answer(self) -> str | None:
        """The answer for its cell (`matbench.solving.worker.serve`); None while it is not complete.

        Raises
        ------
        EOFError
            If the child has closed its end: no answer will come.
        ValueError
            If what came is not an answer.
        """
        found = os.read(self.line.fileno(), LOG_ENDS)
        if not found:
            raise EOFError
        self.heard += found
        if not self.heard.endswith(b"\n"):
            if len(self.heard) > LOG_ENDS:
                raise ValueError("no answer is so long")
            return None
        try:
            said, is_fit = json.loads(self.heard)
        except (TypeError, RecursionError) as error:
            raise ValueError("no answer") from error
        self.heard.clear()
        self.is_fit = is_fit is True
        return str(said)

    def close(self) -> None:
        self.line.close()
        os.close(self.output)


def keep(inbox: Connection) -> None:
    """The keeper's process: solve the jobs that come in, one by one, until the line ends.

    It sends "" after each cell, or why the cell could not be written.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())  # through `finally`: the child goes, too
    processes.lead_own_session()  # Ctrl-C is for the run, which then dismisses its keepers
    child: Child | None = None
    try:
        while True:
            job = inbox.recv()
            try:
                child = _solve_cell(job, inbox, child)
                said = ""
            except (OSError, ValueError) as error:  # the disk is full, say
                processes.kill_descendants()
                child, said = None, str(error)
            inbox.send(said)
    except (EOFError, BrokenPipeError, ConnectionResetError, Dismissed):
        pass
    finally:
        processes.kill_descendants()


def _solve_cell(job: Job, inbox: Connection, child: Child | None) -> Child | None:
    """Solve a cell, by `child` if it suits, else by a new one; return the child if it may solve the next cell, too."""
    store = Store(job.run)
    if child is not None and not child.suits(job):
        processes.kill_descendants()
        child.close()
        child = None
    with store.building(job.cell) as draft:
        if child is not None:
            stays = _attempt(job, draft.resolve(), inbox, child)
            if stays or stays is None:
                return child if stays else None
            # earlier cells may have spoiled a shared process: this cell gets a second chance in a fresh one.
            # Not after a timeout: the cell would take the whole time again.
            _empty(draft)
        child = Child.fork(job, inbox)
        return child if _attempt(job, draft.resolve(), inbox, child) else None


def _attempt(job: Job, draft: Path, inbox: Connection, child: Child) -> bool | None:
    """Have `child` solve a cell and fill its folder.

    Returns
    -------
    Whether the child may solve another cell; None if this one ran into its time limit. A child that may
    not is killed, with all that it has started.
    """
    log, stays = Log(child.output), False
    try:
        outcome = _watch(job, draft, inbox, child, log)
        stays = outcome is None and child.is_fit and job.settings.isolation == "shared"
    finally:
        # first kill, then drain, then close: else output is lost, or the child still prints into a closed pipe
        if not stays:
            processes.kill_descendants()
        log.drain()
        if not stays:
            child.close()
    if outcome is not None:
        _empty(draft)  # of what the child had half written
        write_cell(draft, job.cell, evolve(outcome, threads=job.threads, alone=job.alone))
    (draft / "log.txt").write_bytes(log.whole())
    return None if outcome is not None and outcome.status == "timeout" else stays


def _empty(draft: Path) -> None:
    for half in draft.iterdir():
        if half.is_dir():
            shutil.rmtree(half)
        else:
            half.unlink()


def _watch(job: Job, draft: Path, inbox: Connection, child: Child, log: Log) -> Outcome | None:
    """Wait for the child; None if it has written the cell, else the outcome to write in its place.

    Raises
    ------
    Dismissed
        If the run has gone or wants no more.
    OSError
        If the child could not write the cell.
    """
    begin = time.monotonic()
    limit, memory = job.settings.timeout, job.settings.memory_each()
    kills = processes.kills_for_memory()
    sources: list[Any] = [inbox, child.output, child.line]
    with suppress(OSError):  # it has ended already: seen below
        child.line.send((job, draft))
    looks, next_look = 0, begin
    while True:
        ready = wait(sources, _TICK)
        if inbox in ready:  # no second job comes before the answer: it can only be the end
            raise Dismissed
        if child.output in ready and not log.take():
            sources.remove(child.output)  # a closed pipe is always ready, and `wait` would not wait any more
        if child.line in ready:
            try:
                said = child.answer()
            except (EOFError, OSError):
                sources.remove(child.line)
            except ValueError:
                return Outcome("crashed", reason="the method wrote into a file of the harness that it had not opened")
            else:
                if said:
                    raise OSError(said)
                if said is not None:
                    return None
        if child.pid in (ended := processes.reap()):
            log.drain()
            return _how_it_ended(ended[child.pid], log, kills)
        now = time.monotonic()
        if limit is not None and now - begin > limit:
            _print_stack(child, log)
            return Outcome("timeout", reason=f"stopped after {limit:g} s")
        if now < next_look:
            continue
        # a method that prints all the time wakes `wait` at once; its memory is still read every _TICK only
        looks, next_look = looks + 1, now + _TICK
        used = processes.memory_used(child.pid, whole_tree=looks % _TREE_LOOKS == 0)
        if used > memory:
            _print_stack(child, log)
            return Outcome("out-of-memory", reason=f"stopped: it held {used:.0f} MiB, {memory} MiB are its limit")


def _how_it_ended(status: int, log: Log, kills: int) -> Outcome:
    """The outcome for a child that ended before it answered, by itself or by the system."""
    code = os.waitstatus_to_exitcode(status)
    if b"std::bad_alloc" in log:  # C++ that meets the memory limit aborts: only its message tells this from a crash
        return Outcome("out-of-memory", reason="the method ended its process: std::bad_alloc")
    if code == -signal.SIGKILL and processes.kills_for_memory() > kills:
        return Outcome("out-of-memory", reason="the system ended the method's process: memory had run out")
    if code >= 0:
        return Outcome("crashed", reason=f"the method ended its process (exit status {code})")
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    words = {"SIGSEGV": "segmentation fault, ", "SIGABRT": "abort, ", "SIGFPE": "arithmetic, "}.get(name, "")
    return Outcome("crashed", reason=f"the method's process was ended by a signal ({words}{name})")


def _print_stack(child: Child, log: Log) -> None:
    """Have the child print its stack into the log: SIGABRT makes `faulthandler` do so.

    Whoever reads the log then sees where the method hung, or what took the memory.
    """
    with suppress(ProcessLookupError):
        os.kill(child.pid, signal.SIGABRT)
    end = time.monotonic() + _STACK_SECONDS
    while time.monotonic() < end and child.pid not in processes.reap():
        wait([child.output], _TICK)
        log.drain()


class Keeper:
    """A handle on a keeper's process, held by the run. It is forked from the server of `processes.start_server`.

    Parameters
    ----------
    preload
        Modules that the server imports besides the harness.
    """

    def __init__(self, preload: Iterable[str] = ()) -> None:
        processes.start_server(["matbench.solving.keeper", "cv2", "threadpoolctl", *preload])
        self.line, theirs = Pipe()
        self._process: ForkServerProcess = get_context("forkserver").Process(target=keep, args=(theirs,))
        self._process.start()
        theirs.close()  # else this process itself would keep the line open when the keeper dies

    def begin(self, job: Job) -> None:
        """Start a cell. `line` becomes readable when `outcome` has an answer."""
        with suppress(ConnectionError):  # `outcome` says so
            self.line.send(job)

    def outcome(self, job: Job) -> tuple[Outcome, bool]:
        """Wait for the answer: the cell's outcome, and whether this keeper is still alive."""
        wrong = Outcome("failed", threads=job.threads, alone=job.alone)
        try:
            said = self.line.recv()
        except (EOFError, OSError):
            return evolve(wrong, status="crashed", reason="its keeper was killed"), False
        if said:
            return evolve(wrong, reason=f"its cell could not be written: {said}"), True
        found = Store(job.run).outcome(job.cell)
        return found or evolve(wrong, reason="the cell's process left no result"), True

    def dismiss(self) -> None:
        """Tell the keeper to kill its processes and end; does not wait for it."""
        self.line.close()

    def wait(self) -> None:
        """Wait until a dismissed keeper has ended; after `_PATIENCE` seconds kill it."""
        self._process.join(_PATIENCE)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(_PATIENCE)


def dismiss(keepers: Iterable[Keeper]) -> None:
    """End keepers and all that runs below them."""
    every = list(keepers)  # told all before waiting for the first: they clear away at the same time
    for one in every:
        one.dismiss()
    for one in every:
        one.wait()
