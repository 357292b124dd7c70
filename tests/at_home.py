"""Methods that start processes, threads and programs as they do in a script, as a user's plug-in file."""

import concurrent.futures as futures
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
import typing
from abc import ABC, abstractmethod
from dataclasses import dataclass

import helper_at_home
import numpy as np

from matbench import Context, Estimate, Scene


@dataclass
class Row:
    """What goes to a worker and comes back; its annotation is a text, as that of many classes is."""

    number: int
    following: "Row | None" = None


def doubled(row: Row) -> Row:
    return Row(2 * row.number)


def nested(row: Row) -> int:
    """What a worker that has workers of its own finds; workers of a pool may not start any, those of others may."""
    with multiprocessing.get_context("fork").Pool(1) as pool:
        return int(pool.apply(doubled, [row]).number)


def waits(barrier: "threading.Barrier", found: "multiprocessing.Queue[int]") -> None:
    barrier.wait(20)
    found.put(helper_at_home.tripled(1))


class _AtHome(ABC):
    def __init__(self, start: str = "fork") -> None:
        self.start = start

    def solve(self, scene: Scene, context: Context) -> Estimate:
        value = self.found() if scene.width > 64 else 3.0  # starting workers takes long: not for the warm-up, too
        return Estimate({scene.ref: np.full((scene.height, scene.width), value, np.float32)})

    @abstractmethod
    def found(self) -> float:
        """3 if all is well."""


class Pool(_AtHome):
    def found(self) -> float:
        with multiprocessing.get_context(self.start).Pool(2) as pool:
            one, two = pool.map(doubled, [Row(1), Row(0)], 1)
            return float(one.number + two.number + pool.apply(helper_at_home.tripled, [1]) - 2)


class Executor(_AtHome):
    """Its own methods, and those of its instance, are sent, too."""

    def found(self) -> float:
        with futures.ProcessPoolExecutor(2, multiprocessing.get_context(self.start)) as pool:
            rows = list(pool.map(doubled, [Row(1), Row(0)]))
            return sum(row.number for row in rows) + pool.submit(self.one).result()

    def one(self) -> float:
        return float(type(self) is Executor)


class Default(_AtHome):
    """No start method is named: this system's is used, as in a script."""

    def found(self) -> float:
        with multiprocessing.Pool(1) as pool:
            named = multiprocessing.get_start_method() == multiprocessing.get_all_start_methods()[0]
            return float(pool.apply(doubled, [Row(1)]).number + named)


class Queued(_AtHome):
    def found(self) -> float:
        context = multiprocessing.get_context(self.start)
        barrier, queue = context.Barrier(2), context.Queue()
        worker = context.Process(target=waits, args=(barrier, queue))
        worker.start()
        barrier.wait(100)
        number = queue.get(timeout=100)
        worker.join(100)
        return float(number + worker.exitcode)


class Loader(_AtHome):
    """A worker that has a pool of its own."""

    def found(self) -> float:
        with futures.ProcessPoolExecutor(1, multiprocessing.get_context(self.start)) as pool:
            return pool.submit(nested, Row(1)).result() + 1


class Program(_AtHome):
    """Another Python that is handed an object, as loky and MPI do."""

    def found(self) -> float:
        code = "import pickle, sys; row = pickle.load(sys.stdin.buffer); print(row.number)"
        sent = pickle.dumps(Row(3))
        said = subprocess.run([sys.executable, "-c", code], input=sent, capture_output=True, check=True)
        return float(said.stdout)


class Itself(_AtHome):
    """What libraries ask about the classes of a file, and about the process."""

    def found(self) -> float:
        copy = pickle.loads(pickle.dumps(self))  # noqa: S301 -- its own
        hints = typing.get_type_hints(Row)
        values: list[int] = []
        thread = threading.Thread(target=values.append, args=[1])
        thread.start()
        thread.join()
        is_main = multiprocessing.parent_process() is None and multiprocessing.current_process().name == "MainProcess"
        return float(type(copy) is Itself) + float(hints["following"] == Row | None) + values[0] * is_main


class Counted(_AtHome):
    """Has its memory taken by a worker that a fork server starts; more than the cell may hold."""

    def found(self) -> float:
        with multiprocessing.get_context("forkserver").Pool(1) as pool:
            return float(pool.apply(helper_at_home.held, [600])) + os.getpid() * 0
