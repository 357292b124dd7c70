"""Loaded into a Dask worker (`--preload`): its replies run code where they are unpickled, and it solves nothing."""

import os
import pickle
from collections.abc import Callable
from pathlib import Path

from distributed import get_worker
from distributed.protocol import to_serialize

from matbench.solving import cluster_worker

WAY = Path("way")  # a file in the worker's folder that says how it is hostile now
MARK = "it-ran"  # a folder, made where the process that unpickles works


class Running:
    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return os.mkdir, (MARK,)


class RunningError(Exception):
    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return os.mkdir, (MARK,)


def answer(task: cluster_worker.Task) -> object:
    way = WAY.read_text()
    if way == "reply":
        return Running()
    if way == "large":
        return [Running(), os.urandom(20_000_000)]
    if way == "other":
        return {"worker": 1}
    if way == "error":
        raise RunningError
    if way == "event":
        get_worker().log_event(task.run, to_serialize(Running()))
    if way == "warning":
        get_worker().log_event("warn", {"message": pickle.dumps(Running())})
    return cluster_worker.Reply(get_worker().address, declined="I am hostile").packed()


cluster_worker.solve_task = answer  # type: ignore[assignment]
