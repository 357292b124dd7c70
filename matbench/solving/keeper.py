"""Keepers: processes that run no method but watch, from outside, the process that does.

A keeper solves one cell at a time. It forks a process for it, takes in what that prints, counts its
seconds and its memory, and ends it with all that it started if it takes more than it may. The cell's
folder is the keeper's: whatever becomes of the method, log and outcome are written. A keeper ends,
and ends all below it, as soon as nobody holds the other end of its line, so nothing outlives a run.
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

from matbench.plans import plugins
from matbench.runs.store import Outcome, Store, write_cell
from matbench.solving import processes
from matbench.solving.worker import Job, serve

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerProcess

LOG_ENDS = 1 << 16  # bytes kept of the beginning, and of the end, of what a cell prints
_TICK = 0.05  # seconds between two looks at a process
_TREE_LOOKS = 10  # every so many looks also at those that it started
_LAST_WORDS = 0.5  # seconds that a process which is ended has to say where it was
_PATIENCE = 5.0  # seconds that a keeper has to clear away


class Dismissed(Exception):
    """The keeper's line has ended."""


@define
class Log:
    """The first and the last of what a process prints."""

    source: int
    first: bytearray = field(factory=bytearray)
    last: bytearray = field(factory=bytearray)
    left_out: int = 0

    def take(self) -> bool:
        """Take in what there is; False if there is nothing."""
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
        """Take in what is left, as far as that is of use."""
        for _ in range(64):
            if not self.take():
                return

    def whole(self) -> bytes:
        gap = f"\n... {self.left_out} bytes left out ...\n".encode() if self.left_out else b""
        return bytes(self.first) + gap + bytes(self.last)

    def __contains__(self, words: bytes) -> bool:
        return words in self.first or words in self.last


@define
class Child:
    """The process that runs methods, seen from its keeper.

    Parameters
    ----------
    first
        The job by whose settings it is confined.
    heard
        What it has said on its line so far. Nobody knows what a method writes there: it is read as text,
        as far as there is any, and never waited for.
    """

    pid: int
    line: Connection
    output: int
    first: Job
    is_fit: bool = True
    heard: bytearray = field(factory=bytearray)

    @classmethod
    def fork(cls, job: Job, inbox: Connection) -> "Child":
        line, theirs = Pipe()
        output, printed = os.pipe()
        keeper = os.getpid()
        pid = os.fork()
        if not pid:
            try:
                os.setsid()
                processes.die_with_parent(keeper)
                for ours in (inbox, line):
                    ours.close()
                os.close(output)
                serve(theirs, printed, job)
            finally:
                os._exit(1)
        theirs.close()
        os.close(printed)
        os.set_blocking(output, False)
        return cls(pid, line, output, job)

    def suits(self, job: Job) -> bool:
        """Is another job confined as the first one was, and content with a process that is not its own?"""
        first = self.first
        same = (job.threads, job.settings.memory_each()) == (first.threads, first.settings.memory_each())
        return same and job.settings.isolation == "shared"

    def answer(self) -> str | None:
        """What it says of its cell (`matbench.solving.worker.serve`), None until it has said all of it.

        Raises
        ------
        EOFError
            If nothing more can come.
        ValueError
            If it is no answer.
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
    """Solve the cells of the jobs that come in, one by one; send "" after each, or why it could not be written."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    processes.stand_apart()  # Ctrl-C is for whoever holds the line
    child: Child | None = None
    try:
        while True:
            job = inbox.recv()
            try:
                child = _cell(job, inbox, child)
                said = ""
            except (OSError, ValueError) as error:  # the disk is full, say
                processes.end_all_below()
                child, said = None, str(error)
            inbox.send(said)
    except (EOFError, BrokenPipeError, ConnectionResetError, Dismissed):
        pass
    finally:
        processes.end_all_below()


def _cell(job: Job, inbox: Connection, child: Child | None) -> Child | None:
    """Solve a cell; the child, if it is to solve the next one, too."""
    store = Store(job.run)
    if child is not None and not child.suits(job):
        processes.end_all_below()
        child.close()
        child = None
    with store.building(job.cell) as draft:
        if child is not None:
            stays = _attempt(job, draft.resolve(), inbox, child)
            if stays or stays is None:
                return child if stays else None
            _empty(draft)  # what went before may be to blame: once more, in a fresh process
        plugins.read_ahead(job.cell.method.algorithm, job.plugin_files)
        child = Child.fork(job, inbox)
        return child if _attempt(job, draft.resolve(), inbox, child) else None


def _attempt(job: Job, draft: Path, inbox: Connection, child: Child) -> bool | None:
    """Fill a cell's folder; whether the child is fit for another cell, None where it took too long.

    A child that is not fit is ended, with all that it started.
    """
    log, stays = Log(child.output), False
    try:
        outcome = _watch(job, draft, inbox, child, log)
        stays = outcome is None and child.is_fit and job.settings.isolation == "shared"
    finally:
        if not stays:
            processes.end_all_below()
        log.drain()
        if not stays:
            child.close()
    if outcome is not None:
        _empty(draft)
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
    """Wait until the child has written the cell: None, or what is to be written instead.

    Raises
    ------
    Dismissed
        If the line ends meanwhile.
    OSError
        If the child could not write the cell.
    """
    begin = time.monotonic()
    limit, memory = job.settings.timeout, job.settings.memory_each()
    kills = processes.kills_for_memory()
    sources: list[Any] = [inbox, child.output, child.line]
    with suppress(OSError):  # it has ended already
        child.line.send((job, draft))
    looks, next_look = 0, begin
    while True:
        ready = wait(sources, _TICK)
        if inbox in ready:
            raise Dismissed
        if child.output in ready and not log.take():
            sources.remove(child.output)
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
            return _ended(ended[child.pid], log, kills)
        now = time.monotonic()
        if limit is not None and now - begin > limit:
            _last_words(child, log)
            return Outcome("timeout", reason=f"stopped after {limit:g} s")
        if now < next_look:
            continue
        looks, next_look = looks + 1, now + _TICK
        used = processes.used(child.pid, whole_tree=looks % _TREE_LOOKS == 0)
        if used > memory:
            _last_words(child, log)
            return Outcome("out-of-memory", reason=f"stopped: it held {used:.0f} MiB, {memory} MiB are its limit")


def _ended(status: int, log: Log, kills: int) -> Outcome:
    """What became of a child that has ended by itself, or was ended by the system."""
    code = os.waitstatus_to_exitcode(status)
    if b"std::bad_alloc" in log:
        return Outcome("out-of-memory", reason="the method ended its process: std::bad_alloc")
    if code == -signal.SIGKILL and processes.kills_for_memory() > kills:
        return Outcome("out-of-memory", reason="the system ended the method's process: memory had run out")
    if code >= 0:
        return Outcome("crashed", reason=f"the method ended its process (exit status {code})")
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    words = {"SIGSEGV": "segmentation fault, ", "SIGABRT": "abort, ", "SIGFPE": "arithmetic, "}.get(name, "")
    return Outcome("crashed", reason=f"the method's process was ended by a signal ({words}{name})")


def _last_words(child: Child, log: Log) -> None:
    """Have the child print where it is (`faulthandler`)."""
    with suppress(ProcessLookupError):
        os.kill(child.pid, signal.SIGABRT)
    end = time.monotonic() + _LAST_WORDS
    while time.monotonic() < end and child.pid not in processes.reap():
        wait([child.output], _TICK)
        log.drain()


class Keeper:
    """A keeper's process, from outside; forked from a small server that has imported the libraries once."""

    def __init__(self, preload: Iterable[str] = ()) -> None:
        processes.start_server(["matbench.solving.keeper", "cv2", "threadpoolctl", *preload])
        self.line, theirs = Pipe()
        self._process: ForkServerProcess = get_context("forkserver").Process(target=keep, args=(theirs,))
        self._process.start()
        theirs.close()

    def take(self, job: Job) -> None:
        """Begin with a cell; `line` tells when there is an answer."""
        with suppress(ConnectionError):  # `done` says so
            self.line.send(job)

    def done(self, job: Job) -> tuple[Outcome, bool]:
        """What has become of the cell, and whether this keeper can go on."""
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
        """Tell it to stop whatever it does and clear away; `wait` waits for that."""
        self.line.close()

    def wait(self) -> None:
        """Wait until a dismissed keeper is gone."""
        self._process.join(_PATIENCE)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(_PATIENCE)


def dismiss(keepers: Iterable[Keeper]) -> None:
    """End keepers and all below them."""
    every = list(keepers)
    for one in every:
        one.dismiss()
    for one in every:
        one.wait()
