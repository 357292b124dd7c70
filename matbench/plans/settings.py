"""How a plan is run: where the scenes are, what is kept of each cell besides its maps, and the limits of a cell."""

from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from attrs import field, frozen
from attrs.validators import in_

from matbench.errors import UserError
from matbench.plans import limits
from matbench.plans.record_option import RecordOption

Only = Literal["missing", "failed", "all"]


def _names(given: Iterable[str]) -> tuple[str, ...]:
    return tuple(given)


@frozen
class Settings:
    """Settings that cannot change a cell's answer. So they are not part of its key.

    Parameters
    ----------
    data
        The folder of real scenes, if there is one.
    record
        What to record of every cell, from a second, untimed solve; nothing if None.
    volumes
        Also keep the volumes of methods that have one.
    only
        Which cells to compute: ``missing``, those never computed; ``failed``, those that did not end well;
        ``all``, every cell again. If None, every cell that is not done.
    timeout
        Seconds that a cell may take in all: reading the scene, warm-up, solve, recording. None for no limit.
    memory
        MiB that a cell's processes may hold together, or a text such as ``"4G"``. None for an
        equal share of nine tenths of the machine's.
    jobs
        How many cells run at once.
    threads
        How many threads each method gets; if None, the cores are divided among the `jobs`.
    isolation
        ``"process"``: each cell has a process of its own. ``"shared"``: a process solves one cell
        after the other, until one goes wrong; for trusted methods.
    dask
        The address of the Dask scheduler that hands out the cells; ``"local"`` for a cluster of `jobs`
        workers on this machine; None for no cluster.
    steady
        At the end, solve the cells again whose seconds are in doubt because others took the processors meanwhile.
        These run one at a time. Not with `dask`.
    published
        Show scores as published beside those of scenes that were judged alike. Nothing of a cell depends on it.
    metrics
        Names of metrics to compute besides those of every run, such as ``bad_3``; the first is what methods are
        ranked by. If none are named, what the scenes' benchmark reports. Nothing of a cell depends on it.
    against
        Folder of an earlier run: what has changed since is told, too. Nothing of a cell depends on it.

    Raises
    ------
    UserError
        For a limit, a count or an address that makes no sense, and for `steady` with `dask`.
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
    dask: str | None = field(default=None, converter=limits.scheduler)
    steady: bool = False
    published: bool = False
    metrics: tuple[str, ...] = field(default=(), converter=_names)
    against: Path | None = None

    def __attrs_post_init__(self) -> None:
        if self.steady and self.dask is not None:
            raise UserError("steady solves cells again on this machine: leave it out where dask hands them out")

    def threads_each(self) -> int:
        """How many threads each method is given on this machine."""
        return self.threads or max(1, limits.cores() // self.jobs)

    def memory_each(self) -> int:
        """How many MiB each cell may hold on this machine."""
        return self.memory or max(1, limits.room() // self.jobs)
