"""What a solve had of the machine, and what others took meanwhile, as the system counts it (Linux).

Three counts of processor seconds, none of which the method reports itself:

- its own: the clocks of its process and of all below it;
- others': what all processors did (``/proc/stat``), less its own. The system counts in hundredths of a second, so
  this says something from a few tenths of a second on;
- stolen: what a hypervisor gave to other machines (``steal``), and what a control group's quota held back.
"""

import os
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import psutil
from attrs import frozen

TOO_MUCH = 0.1
"""Share of the processor time within a solve's reach from which on what others took makes its times doubtful.

A tenth: what an idle desktop does besides stays below it; a program that keeps one core busy does not.
"""
SHORTEST = 0.2
"""Seconds over which others' share can be told: 20 ticks of the system's count."""
_TICKS = os.sysconf("SC_CLK_TCK")


@frozen
class Moment:
    """Counts at one time, in seconds.

    Parameters
    ----------
    clock
        Wall time.
    busy
        Processor seconds of everything on the machine since it was started.
    stolen
        Of the hypervisor and of quotas.
    own
        Processor seconds of a process and of all below it.
    """

    clock: float
    busy: float
    stolen: float
    own: float


@frozen
class Share:
    """What happened between two moments, in seconds."""

    wall: float
    own: float
    others: float
    stolen: float

    def is_disturbed(self, threads: int, cores: int) -> bool:
        """Did others take more than `TOO_MUCH` of what the solve could have used?

        A solve of one thread beside another program on two cores is not disturbed: what it could use was free.
        """
        if self.wall < SHORTEST:
            return False
        reach = self.wall * min(threads, cores)
        free = self.wall * cores - self.others - self.stolen
        return free < (1 - TOO_MUCH) * reach


def moment(pid: int) -> Moment:
    """Now, for the process `pid` and what lies below it."""
    busy, stolen = _machine()
    return Moment(time.monotonic(), busy, stolen + _throttled(), processor_seconds(pid))


def between(before: Moment, after: Moment) -> Share:
    """What happened from one moment to the next; what cannot be negative is not, whatever the rounding."""
    own = max(0.0, after.own - before.own)
    return Share(
        wall=after.clock - before.clock,
        own=own,
        others=max(0.0, after.busy - before.busy - own),
        stolen=max(0.0, after.stolen - before.stolen),
    )


def processor_seconds(pid: int) -> float:
    """Processor seconds of a process and all below it: those that live, and the children that have ended."""
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        return sum(map(_of_one, [process, *process.children(recursive=True)]))
    return 0.0


def _of_one(process: psutil.Process) -> float:
    ended = 0.0
    with suppress(psutil.Error):
        times = process.cpu_times()
        ended = getattr(times, "children_user", 0.0) + getattr(times, "children_system", 0.0)
        with suppress(OSError):  # the process's own clock counts nanoseconds (CPUCLOCK_SCHED, see clock_getcpuclockid)
            return time.clock_gettime((~process.pid << 3) | 2) + ended
        return times.user + times.system + ended
    return ended


def _machine() -> tuple[float, float]:
    """Processor seconds of all that runs on this machine, and those that a hypervisor gave to others."""
    with suppress(OSError, ValueError, IndexError):
        words = Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:]
        user, nice, system, _, _, irq, softirq, steal = (int(word) / _TICKS for word in words[:8])
        return user + nice + system + irq + softirq, steal
    return 0.0, 0.0


def _throttled() -> float:
    """Seconds for which a quota has held this process's control group back."""
    for path, unit in _quotas():
        with suppress(OSError, ValueError):
            for line in path.read_text().splitlines():
                name, _, value = line.partition(" ")
                if name in ("throttled_usec", "throttled_time"):
                    return int(value) * unit
    return 0.0


def _quotas() -> Iterable[tuple[Path, float]]:
    """Where either version of control groups counts, and in which part of a second."""
    return (Path("/sys/fs/cgroup/cpu.stat"), 1e-6), (Path("/sys/fs/cgroup/cpu/cpu.stat"), 1e-9)
