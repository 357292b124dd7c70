"""What a Dask worker does with the cell that it is sent: decline it, or solve it and send its folder back.

This machine (`matbench.solving.cluster`) sends a `Task` and gets a `Reply`, as bytes.
"""

import atexit
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any

from attrs import define, evolve, frozen

from matbench.errors import UserError, failure
from matbench.files.documents import parse_json
from matbench.files.temporary import temporary_folder
from matbench.plans import plugins
from matbench.plans.limits import cores
from matbench.plans.plan import Cell, plugin_of
from matbench.plans.settings import Settings
from matbench.runs import parcels
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scenes.catalogue import data_root, load_scene
from matbench.solving.keeper import Keeper
from matbench.solving.worker import Job

_LONGEST_LINE = 1 << 16  # bytes of a reply before the parcel
_TICK = 0.2  # seconds between two looks at whether the client still wants a task


@frozen
class Task:
    """A cell on its way to a worker.

    Parameters
    ----------
    run
        The name of the run on the cluster: the topic of its events, and part of its tasks' keys.
    files
        The users' own files: the name of each, and by their paths below its folder the content of all that it imports
        from there, itself included. If the cell's method was named with a file, that is the last one.
    """

    run: str
    cell: Cell
    files: tuple[tuple[str, Mapping[str, bytes]], ...]
    settings: Settings


@frozen
class Reply:
    """A worker's reply: the solved cell, or why it declined to solve it.

    Parameters
    ----------
    worker
        The worker's address.
    parcel
        The cell's folder, packed (`matbench.runs.parcels`).
    declined
        The reason; empty if the cell was solved.
    """

    worker: str
    parcel: bytes = b""
    declined: str = ""

    def packed(self) -> bytes:
        """The reply as bytes: a line of JSON, then the parcel."""
        return json.dumps([self.worker, self.declined]).encode() + b"\n" + self.parcel

    @classmethod
    def unpacked(cls, sent: object) -> "Reply":
        """What `packed` gave.

        Raises
        ------
        ValueError
            If it is anything else.
        """
        if not isinstance(sent, bytes):
            raise ValueError(f"a worker answered with {type(sent).__name__}, not with bytes")
        line, _, parcel = sent.partition(b"\n")
        found = parse_json(line) if len(line) < _LONGEST_LINE else None
        if not (isinstance(found, list) and len(found) == 2 and all(isinstance(one, str) for one in found)):
            raise ValueError("a worker's answer is no reply")
        worker, declined = (" ".join(one.split()) for one in found)
        return cls(worker, parcel, declined)


def solve_task(task: Task) -> bytes:
    """Solve a cell. This runs on a Dask worker; its reply is packed, and errors are told in it."""
    from distributed import get_worker

    worker = get_worker()
    try:
        return _solved(task, worker).packed()
    except Exception as error:  # Dask would send it as a pickle
        return Reply(worker.address, declined=f"the worker failed: {failure(error)}").packed()


def _solved(task: Task, worker: Any) -> Reply:
    with temporary_folder() as folder:
        files, cell = _with_files(task, folder)
        root = _data_folder(task.settings.data)
        why = _why_declined(cell, files, root)
        if why:
            return Reply(worker.address, declined=why)
        worker.log_event(task.run, task.cell.key)
        at_once = worker.state.nthreads
        settings = evolve(
            task.settings,
            data=root,
            threads=task.settings.threads or max(1, cores() // at_once),
            memory=task.settings.memory or evolve(task.settings, jobs=min(at_once, 256)).memory_each(),
        )
        store = Store(folder / "run")
        (store.folder / "cells").mkdir(parents=True)
        job = Job(store.folder, cell, files, settings.threads_each(), settings, alone=False)
        outcome = _have_solved(job, worker, worker.get_current_task())
        if not store.cell(task.cell).exists():
            return Reply(worker.address, declined=outcome.reason)
        return Reply(worker.address, parcels.pack(store.cell(task.cell)))


def _have_solved(job: Job, worker: Any, key: Any) -> Outcome:
    """Have a keeper of this worker solve a cell; dismiss the keeper if the client has cancelled the task.

    Dask cannot interrupt a task that runs, so the task itself looks whether it is still wanted.
    """
    keeper = _keepers.get()
    lives = False
    try:
        keeper.begin(job)
        while not keeper.line.poll(_TICK) and not keeper.is_lost():
            wanted = worker.state.tasks.get(key)
            if wanted is None or wanted.state != "executing":
                return Outcome("interrupted", reason="nobody wants it any more")
        outcome, lives = keeper.outcome(job)
        return outcome
    finally:
        if lives:
            _keepers.free.put(keeper)
        else:
            keeper.dismiss()
            keeper.wait()


@define
class Keepers:
    """The keepers of this worker process, kept for later cells: at most as many as cells have run at once.

    Parameters
    ----------
    free
        Those that have no cell now.
    starting
        Held while one is started, as that changes the state of the whole process for a moment.
    """

    free: "SimpleQueue[Keeper]"
    starting: Lock

    def get(self) -> Keeper:
        """A free one, or a new one."""
        with suppress(Empty):
            return self.free.get_nowait()
        from matbench.runs.provenance import commit_known
        from matbench.solving.environment import kernel_cache_in_use, without_main

        with self.starting, without_main(), kernel_cache_in_use(), commit_known():
            return Keeper(_built_in())

    def dismiss(self) -> None:
        """End all free keepers."""
        with suppress(Empty):
            while True:
                self.free.get_nowait().dismiss()


def _built_in() -> list[str]:
    """The modules of all built-in methods and datasets: a worker does not know which cells it will be given."""
    every = [*plugins.installed("algorithms").values(), *plugins.installed("datasets").values()]
    entries = [plugin.entry for plugin in every if plugin.source == plugins.OWN]
    return [entry.module for entry in entries if not isinstance(entry, type)]


_keepers = Keepers(SimpleQueue(), Lock())
atexit.register(_keepers.dismiss)


def _with_files(task: Task, folder: Path) -> tuple[tuple[str, ...], Cell]:
    """The users' files as they lie on this machine now, and the cell with the one that its method was named with."""
    files, cell = _write_files(task.files, folder), task.cell
    if not cell.method.file:
        return files, cell
    return files[:-1], evolve(cell, method=evolve(cell.method, file=files[-1]))


def _write_files(files: Sequence[tuple[str, Mapping[str, bytes]]], folder: Path) -> tuple[str, ...]:
    """Write the users' files, each into a folder of its own: names may be equal, and count in digests. Their paths."""
    for number, (_, contents) in enumerate(files):
        for name, content in contents.items():
            path = folder / str(number) / name
            if not path.resolve().is_relative_to((folder / str(number)).resolve()):  # ../x would be written elsewhere
                raise ValueError(f"{name!r} is no path below a folder")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    return tuple(str(folder / str(number) / name) for number, (name, _) in enumerate(files))


def _data_folder(named: Path | None) -> Path | None:
    """This worker's folder of real scenes: its own, else the one that the client names if it exists here."""
    with suppress(UserError):
        own = data_root()
        if own is not None:
            return own
    return named if named is not None and named.is_dir() else None


def _why_declined(cell: Cell, files: Sequence[str], root: Path | None) -> str:
    """Why this worker must decline: it has other code, or lacks the scene or has another; empty if it need not."""
    name, known = cell.method.algorithm, plugins.installed("algorithms")
    candidates = [plugins.Plugin(name, file, object) for file in (*files, *filter(None, [cell.method.file]))]
    candidates += [known[name]] if name in known else []
    if not candidates:
        return f"the worker has no method {name}: install what offers it there"
    try:
        is_same = cell.method.code in map(plugins.code_digest, candidates) or cell.method.code == _code_digest(
            cell, files
        )
    except (ImportError, OSError, UserError) as error:
        return f"the worker cannot use {name}: {failure(error)}"
    if not is_same:
        return f"the worker has other code of {name}, or other versions of what it imports: install the same"
    try:
        own = () if cell.scene.partition("/")[0] in plugins.installed("datasets") else tuple(files)
        if _scene_digest(cell.scene, root, own) != cell.scene_digest:
            return f"the worker's {cell.scene} is another one: give all workers the same data"
    except Exception as error:
        return f"the worker has not {cell.scene}: {failure(error)}"
    return ""


def _code_digest(cell: Cell, files: Sequence[str]) -> str:
    """The digest of a cell's method and of the files that it names; an instance is built, as only that names them."""
    plugin = plugin_of(cell.method, [Path(file) for file in files])
    return plugins.method_digest(plugin, plugin.make(cell.method.params))


@cache
def _scene_digest(scene: str, root: Path | None, files: tuple[str, ...]) -> str:
    """The digest of a scene as this machine has it; `files` may hold its dataset."""
    return load_scene(scene, root, files).digest
