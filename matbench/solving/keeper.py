"""Keepers, as the run sees them: each is a process that has cells solved and watches that.

What goes on in a keeper is told in `matbench.solving.keeper_process`.
"""

from collections.abc import Iterable
from contextlib import suppress
from multiprocessing import Pipe, get_context
from typing import TYPE_CHECKING

from attrs import evolve

from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.solving import processes
from matbench.solving.keeper_process import keep
from matbench.solving.worker import Job

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerProcess

_PATIENCE = 5.0  # seconds that a dismissed keeper has to end its processes


class Keeper:
    """A handle on a keeper's process, held by the run. It is forked from the server of `processes.start_server`.

    Parameters
    ----------
    preload
        Modules that the server imports besides the harness.
    """

    def __init__(self, preload: Iterable[str] = ()) -> None:
        processes.start_server(["matbench.solving.keeper_process", "cv2", "threadpoolctl", *preload])
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
