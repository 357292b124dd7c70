"""How a plan is worked through: where scenes lie, what is kept of each cell besides its maps, and what it may take."""

from pathlib import Path
from typing import Literal

from attrs import field, frozen
from attrs.validators import in_

from matbench.plans import limits
from matbench.plans.record_option import RecordOption

Only = Literal["missing", "failed", "all"]


@frozen
class Settings:
    """What does not decide a cell's answer, and so stands in no key.

    Parameters
    ----------
    data
        The folder of real scenes, if there is one.
    record
        What to record of every cell, from a second, untimed solve; nothing if None.
    volumes
        Keep the volumes of the methods that have one.
    only
        Which cells: ``missing`` were never computed, ``failed`` did not end well, ``all`` again; if
        None, whatever is not done.
    timeout
        Seconds that a cell may take, all told: reading the scene, warm-up, solve, recording. None for no limit.
    memory
        MiB that a cell's processes may hold together, or a text such as ``"4G"``. None for an
        equal share of nine tenths of the machine's.
    jobs
        How many cells run at once.
    threads
        How many threads each method is given; the cores, shared out to `jobs`, if None.
    isolation
        ``"process"``: each cell has a process of its own. ``"shared"``: a process solves one cell
        after the other, until one goes wrong; for trusted methods.
    dask
        The address of the Dask scheduler that hands out the cells; ``"local"`` for a cluster of `jobs`
        workers on this machine; None for no cluster.

    Raises
    ------
    UserError
        For a limit or a count that makes no sense.
    """

    data: Path | None = None
    record: RecordOption | None = None
    volumes: bool = False
    only: Only | None = field(default=None, validator=in_((None, "missing", "failed", "all")))
    timeout: float | None = field(default=limits.HOUR, converter=limits.seconds)
    memory: int | None = field(default=None, converter=limits.mebibytes)
    jobs: int = field(default=1, converter=limits.jobs)
    threads: int | None = field(default=None, converter=limits.threads)
    isolation: str = field(default="process", converter=limits.isolation)
    dask: str | None = None

    def threads_each(self) -> int:
        """How many threads each method is given on this machine."""
        return self.threads or max(1, limits.cores() // self.jobs)

    def memory_each(self) -> int:
        """How many MiB each cell may hold on this machine."""
        return self.memory or max(1, limits.room() // self.jobs)
