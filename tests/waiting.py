"""Waiting for what other processes do: as long as it takes on a busy machine, and no longer than it does."""

import time
from collections.abc import Callable

import psutil


def wait_until(happens: Callable[[], object], seconds: float = 120, what: str = "it") -> None:
    end = time.monotonic() + seconds
    while not happens():
        assert time.monotonic() < end, f"{what} never happened"
        time.sleep(0.02)


def lives(pid: int) -> bool:
    """Is there such a process, and has it not ended unnoticed?"""
    return psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
