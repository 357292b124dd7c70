"""Keepers, as the run sees them: each is a process that has cells solved and watches that.

What goes on in a keeper is told in `matbench.solving.keeper_process`.
"""

import time
from collections.abc import Iterable
from contextlib import suppress
from multiprocessing import Pipe

from attrs import evolve

from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.solving import processes
from matbench.solving.keeper_process import keep
from matbench.solving.watcher import Watcher
from matbench.solving.worker import Job

LOOK = 0.5
"""Seconds after which a run looks again whether its keepers are lost (`Keeper.is_lost`)."""
_GRACE = 300.0  # seconds beyond a cell's time: its answer is checked and written, perhaps to a slow disk
_MOST_WORDS = 1 << 16  # bytes of what a keeper says


class Keeper:
    """A handle on a keeper's process, held by the run.

    Parameters
    ----------
    preload
        Modules that the fork server imports besides the harness.
    """

    def __init__(self, preload: Iterable[str] = ()) -> None:
        own = ["matbench.solving.keeper_process", "matbench.solving.numba_ready"]
        others = ["cv2", "platformdirs", "threadpoolctl"]
        processes.start_server([*own, *others, *preload, "matbench.solving.kernels_ready"])
        self.line, theirs = Pipe()
        self._watcher = Watcher(keep, (theirs,))
        theirs.close()  # else this process itself would keep the line open when the keeper dies
        self._end: float | None = None
        self._lost = ""

    def begin(self, job: Job) -> None:
        """Start a cell. `line` becomes readable when `outcome` has an answer."""
        limit = job.settings.timeout
        self._end = None if limit is None else time.monotonic() + limit + _GRACE
        with suppress(ConnectionError):  # `outcome` says so
            self.line.send(job)

    def is_lost(self) -> bool:
        """Will no answer come any more, as a method has stopped this keeper, say? To be asked again and again."""
        if self._watcher.is_stopped():
            self._lost = "its keeper was stopped"
        elif self._end is not None and time.monotonic() > self._end:
            self._lost = "its keeper has given no answer"
        return bool(self._lost)

    def outcome(self, job: Job) -> tuple[Outcome, bool]:
        """Wait for the answer: the cell's outcome, and whether this keeper is still of use."""
        wrong = Outcome("failed", threads=job.threads, alone=job.alone)
        while not self.line.poll(LOOK):
            if self.is_lost():
                return evolve(wrong, status="crashed", reason=self._lost), False
        try:
            said = self.line.recv_bytes(_MOST_WORDS).decode("utf-8", "replace")
        except (EOFError, OSError):
            return evolve(wrong, status="crashed", reason="its keeper was killed"), False
        if said:
            return evolve(wrong, reason=f"it could not be solved or stored: {said}"), True
        found = Store(job.run).outcome(job.cell)
        return found or evolve(wrong, reason="the cell's process left no result"), True

    def dismiss(self) -> None:
        """Tell the keeper to kill its processes and end; does not wait for it."""
        self.line.close()

    def wait(self) -> None:
        """Wait until a dismissed keeper has ended, with all that was below it."""
        self._watcher.end(at_once=bool(self._lost))


def dismiss(keepers: Iterable[Keeper]) -> None:
    """End keepers and all that runs below them."""
    every = list(keepers)  # told all before waiting for the first: they clear away at the same time
    for one in every:
        one.dismiss()
    for one in every:
        one.wait()
