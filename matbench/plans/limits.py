"""Limits of a cell, read as users write them: seconds, memory, threads, and how many cells run at once."""

import os
import re
from contextlib import suppress
from math import isfinite
from pathlib import Path
from urllib.parse import urlsplit

from matbench.errors import UserError

HOUR = 3600.0
_MOST = 256  # of cells that run at once, and of threads
_UNITS = {"": 1, "m": 1, "g": 1024, "t": 1024 * 1024}


def seconds(value: object) -> float | None:
    """A time limit in seconds; None for None or ``"none"``: no limit.

    Raises
    ------
    UserError
        If it is not a positive number.
    """
    if value is None or value == "none":
        return None
    with suppress(TypeError, ValueError, OverflowError):
        number = float(value)  # type: ignore[arg-type]
        if isfinite(number) and number > 0 and not isinstance(value, bool):
            return number
    raise UserError(f"timeout {value!r} is not a positive number of seconds, such as 600, or none")


def duration(name: str, text: str) -> float | None:
    """Seconds from a text such as ``90``, ``90s``, ``10m`` or ``2h``; None for ``none``: no limit.

    >>> duration("budget", "1.5h")
    5400.0

    Raises
    ------
    UserError
        If it is anything else, or nothing.
    """
    if text == "none":
        return None
    found = re.fullmatch(r"([0-9]{1,6}(?:\.[0-9]{1,3})?)([smh]?)", text)
    seconds = float(found.group(1)) * {"": 1, "s": 1, "m": 60, "h": 3600}[found.group(2)] if found else 0
    if not seconds:
        raise UserError(f"{name} {text!r} is no time such as 90s, 10m or 2h")
    return seconds


def mebibytes(value: object) -> int | None:
    """A memory limit in MiB, from a number of MiB or a text such as ``512M`` or ``1.5G``.

    >>> mebibytes("1.5G")
    1536

    Raises
    ------
    UserError
        If it is anything else, or less than 1 MiB.
    """
    if value is None:
        return None
    found = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,9})?) ?(?:([mgt])(?:i?b)?)?", str(value).lower())
    amount = int(float(found.group(1)) * _UNITS[found.group(2) or ""]) if found else 0
    if amount < 1:
        raise UserError(f"memory {value!r} is not an amount such as 512 (MiB), 512M or 4G")
    return amount


def jobs(value: object) -> int:
    """How many cells run at once.

    Raises
    ------
    UserError
        If it is no whole number from 1 to 256.
    """
    return _counted("jobs", value)


def threads(value: object) -> int | None:
    """How many threads each method gets; None means an equal share of the cores.

    Raises
    ------
    UserError
        If it is no whole number from 1 to 256.
    """
    return None if value is None else _counted("threads", value)


def _counted(name: str, value: object) -> int:
    number = int(str(value)) if re.fullmatch(r"[0-9]{1,9}", str(value)) else 0
    if not 1 <= number <= _MOST:
        raise UserError(f"{name} {value!r} is not a whole number from 1 to {_MOST}")
    return number


def isolation(value: object) -> str:
    """How cells are separated: ``process``, one process each, or ``shared``, many cells in one process.

    Raises
    ------
    UserError
        If it is neither of these words.
    """
    if value not in ("process", "shared"):
        raise UserError(f"isolation {value!r} is not process or shared")
    return str(value)


def scheduler(value: object) -> str | None:
    """The address of a Dask scheduler, or ``local``.

    Raises
    ------
    UserError
        If it is neither.
    """
    if value is None:
        return None
    address = str(value)
    if address == "local":
        return address
    with suppress(ValueError):  # a port that is no number, brackets without an end
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        if parts.hostname and parts.port:
            return address
    raise UserError(f"Dask scheduler {address!r} is no address: write tcp://HOST:PORT of one that runs, or local")


def cores() -> int:
    """How many processor cores this process may use."""
    # `cpu_count` also counts cores that a cluster or a container has not given to this process
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def room() -> int:
    """Memory in MiB for a run without a limit: nine tenths of the machine's, or of its container's if that has less."""
    import psutil

    total = psutil.virtual_memory().total
    with suppress(OSError, ValueError):  # no container, or "max" for one without a limit
        total = min(total, int(Path("/sys/fs/cgroup/memory.max").read_text()))
    return int(total * 0.9) // (1 << 20)


def crowded(at_once: int, threads_each: int) -> str:
    """A warning if the cells that run at once have more threads than there are cores; else an empty text."""
    if at_once * threads_each <= cores():
        return ""
    return f"{at_once} cells at once with {threads_each} threads each share {cores()} cores: they slow one another down"
