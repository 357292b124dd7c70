"""The process that runs methods, as its keeper sees it: what it prints, and what it says."""

import json
import os
from multiprocessing import Pipe
from multiprocessing.connection import Connection

from attrs import define, field
from cattrs.preconf.json import make_converter

from matbench import linux
from matbench.solving.worker import Job, Message, print_to, serve

LOG_ENDS = 1 << 16  # bytes kept of the beginning, and of the end, of a cell's output: a method may print without end

_converter = make_converter()


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
        The pipe for orders and messages.
    output
        The file descriptor of what it prints.
    first
        The job by whose settings it is confined.
    is_fit
        May it solve another cell? It says so itself.
    heard
        The part of a message that has come so far. A method may write anything into this pipe by mistake.
        So messages are lines of JSON, never pickles, and the keeper reads what is there and never waits
        for more.
    """

    pid: int
    line: Connection
    output: int
    first: Job
    is_fit: bool = True
    heard: bytearray = field(factory=bytearray)

    @classmethod
    def fork(cls, job: Job, inbox: Connection, confined: bool) -> "Child":
        """Start a child that solves the cells sent to it. In the child this never returns.

        It is forked from the keeper, which has the libraries loaded already and runs one thread only; it is
        `confined` where the system can do that (`matbench.solving.confinement`).
        """
        line, theirs = Pipe()
        output, printed = os.pipe()
        keeper = os.getpid()
        pid = os.fork()
        if not pid:
            try:
                os.setsid()  # a method that signals its process group must not reach the keeper
                linux.die_with_parent(keeper)
                # an end that stayed open here would keep the pipe alive when the keeper or the run has gone
                for ours in (inbox, line):
                    ours.close()
                os.close(output)
                print_to(printed)
                serve(theirs, job, confined)
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

    def messages(self) -> list[Message]:
        """What it has said since it was last asked (`matbench.solving.worker.Message`).

        Raises
        ------
        EOFError
            If the child has closed its end: nothing more will come.
        ValueError
            If what came is no message.
        """
        found = os.read(self.line.fileno(), LOG_ENDS)
        if not found:
            raise EOFError
        *lines, rest = (bytes(self.heard) + found).split(b"\n")
        self.heard = bytearray(rest)
        if len(rest) > LOG_ENDS:
            raise ValueError("no message is so long")
        try:
            return [_converter.structure(json.loads(line), Message) for line in lines]
        except Exception as error:  # whatever JSON and cattrs raise
            raise ValueError("no message") from error

    def close(self) -> None:
        self.line.close()
        os.close(self.output)
