"""Solving the cells of a plan on a Dask cluster.

A worker solves each cell as this machine would: in a process of its own, watched by a keeper, in a
temporary folder. It sends that folder back as bytes. Users' own files are sent to the worker, with what
they import beside them. Files that a method reads are not, as they may be large: each worker needs them by the same
path. Scenes are not sent either: the worker reads them from its own data folder, or from the one named here if it has
that, and compares digests. A worker with other code or another scene declines the cell.

Dask exchanges tasks as pickles: whoever can reach the scheduler can run programs on the workers.
"""

import atexit
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from multiprocessing import current_process
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any, Literal
from uuid import uuid4

from attrs import define, evolve, frozen

from matbench import code
from matbench.errors import UserError, failure
from matbench.files.unzip import ArchiveError
from matbench.plans import plugins
from matbench.plans.limits import cores
from matbench.plans.plan import Cell, Plan
from matbench.plans.settings import Settings
from matbench.runs import parcels
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scenes.catalogue import data_root, load_scene
from matbench.solving.keeper import Keeper
from matbench.solving.worker import Job

_PATIENCE = "10s"  # that the scheduler has to answer
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
        from there, itself included.
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


def run_cells(
    plan: Plan,
    store: Store,
    settings: Settings,
    todo: Sequence[Cell],
    tell: Callable[[Literal["start", "done"], Cell, Outcome | None], None],
) -> None:
    """Have a cluster solve cells, and put each into the run folder when it arrives.

    A cell that one worker declines goes to another. A cell whose worker dies is tried again by Dask, a few
    times. `KeyboardInterrupt` also stops the cells that run on the workers.

    Parameters
    ----------
    todo
        The cells of the plan to solve.
    tell
        Called as each cell starts and ends.

    Raises
    ------
    UserError
        If the cluster cannot be reached, or Dask is not installed.
    """
    if settings.dask == "local":
        settings = evolve(settings, threads=settings.threads_each(), memory=settings.memory_each())
    files = tuple((Path(file).name, _with_helpers(Path(file))) for file in plan.plugin_files)
    with _client(settings) as client:
        from distributed import as_completed

        arriving = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        this_run = f"matbench-{uuid4().hex}"
        waiting = {cell.key: cell for cell in todo}
        telling = Lock()  # a cell's start is reported in a thread of the Dask client, its end in this one
        tasks: dict[str, tuple[Task, list[Reply]]] = {}
        futures: dict[str, Any] = {}

        def begins(key: str) -> None:
            with telling:
                if (cell := waiting.pop(key, None)) is not None:
                    tell("start", cell, None)

        def ends(cell: Cell, outcome: Outcome) -> None:
            begins(cell.key)  # events may be late or lost; a start is told before an end all the same
            with telling:
                tell("done", cell, outcome)

        def submit(task: Task, before: list[Reply]) -> None:
            # other workers stay allowed: without that, a task waits for ever if the preferred ones leave the cluster
            chosen = {"workers": _other_workers(client, before), "allow_other_workers": True} if before else {}
            # pure=False and a key of its own: Dask would else return an earlier run's result of the same task
            future = client.submit(solve_task, task, key=(this_run, task.cell.key, len(before)), pure=False, **chosen)
            tasks[future.key], futures[future.key] = (task, before), future
            arriving.add(future)

        client.subscribe_topic(this_run, lambda event: begins(event[1]))
        try:
            for cell in todo:
                submit(Task(this_run, cell, files, settings), [])
            for future, reply in arriving:
                task, before = tasks.pop(future.key)
                del futures[future.key]
                if future.status == "finished" and reply.declined and _other_workers(client, [*before, reply]):
                    submit(task, [*before, reply])
                    continue
                ends(task.cell, _keep_reply(store, task.cell, future, reply, before))
        finally:
            with telling:
                waiting.clear()  # late events tell nothing any more
            client.cancel(list(futures.values()), force=True)


def _with_helpers(file: Path) -> dict[str, bytes]:
    """A user's own file and what it imports beside it: path below its folder -> content."""
    return {name: one.read_bytes() for name, one in code.of_file(file).beside(file.parent).items()}


def _other_workers(client: Any, declined: Sequence[Reply]) -> list[str]:
    """The workers that have not declined the cell; none if one declined twice: then nobody else is left to ask."""
    tried = [reply.worker for reply in declined]
    if len(set(tried)) < len(tried):
        return []
    return [worker for worker in client.scheduler_info(n_workers=-1)["workers"] if worker not in tried]


def _keep_reply(store: Store, cell: Cell, future: Any, reply: Any, before: Sequence[Reply]) -> Outcome:
    """Put an arrived cell into the run folder; its outcome, or the outcome that says why none came."""
    wrong = Outcome("failed", alone=False)
    if future.status == "finished" and not reply.declined:
        try:
            return parcels.put(store, cell, reply.parcel)
        except (ArchiveError, OSError) as error:
            return evolve(wrong, reason=f"its cell could not be written: {error}")
    if future.status == "finished":
        every = {one.declined: one.worker for one in [*before, reply]}
        return evolve(wrong, reason="; ".join(f"{why} ({worker})" for why, worker in every.items()))
    if future.status == "cancelled":
        return evolve(wrong, status="interrupted", reason="the cluster has dropped it")
    lost = reply[1] if isinstance(reply, tuple) else reply
    return evolve(wrong, status="crashed", reason=f"no worker finished it: {failure(lost)}")


@contextmanager
def _client(settings: Settings) -> Iterator[Any]:
    """A client of the cluster that the settings name. A local cluster is started, and ends with the client."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise UserError("--dask needs Dask: pip install 'matbench-stereo[cluster]'") from error

    for name in ("distributed", "distributed.client"):  # failures are told as the cells' outcomes
        logging.getLogger(name).setLevel(logging.CRITICAL)
    cluster: Any = None
    try:
        if settings.dask == "local":
            cluster = LocalCluster(
                n_workers=settings.jobs, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
            )
        client = Client(cluster or settings.dask, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:  # TimeoutError, too
        if cluster is not None:
            cluster.close()
        raise UserError(
            f"Dask scheduler {settings.dask!r} cannot be reached: write tcp://HOST:PORT of one that runs, or local"
        ) from error
    patience = 2  # seconds to close after Ctrl-C, when a user will not wait; more after a whole run
    try:
        yield client
        patience = 10
    finally:
        for one in (client, cluster):
            if one is not None:
                with suppress(Exception):
                    one.close(timeout=patience)


# on the workers


def solve_task(task: Task) -> Reply:
    """Solve a cell. This runs on a Dask worker."""
    from distributed import get_worker

    worker = get_worker()
    with TemporaryDirectory(prefix="matbench-") as folder:
        files = _write_files(task.files, Path(folder))
        root = _data_folder(task.settings.data)
        why = _why_declined(task.cell, files, root)
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
        store = Store(Path(folder) / "run")
        (store.folder / "cells").mkdir(parents=True)
        job = Job(store.folder, task.cell, files, settings.threads_each(), settings, alone=False)
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
        while not keeper.line.poll(_TICK):
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

        # Dask's workers are daemonic processes, which `multiprocessing` lets start no children, as these could
        # outlive them. Keepers cannot: they end with their line. So the mark is taken off for this moment.
        with self.starting, without_main(), kernel_cache_in_use(), commit_known():
            config = current_process()._config  # type: ignore[attr-defined]
            before = config.get("daemon")
            config["daemon"] = False
            try:
                return Keeper(_built_in())
            finally:
                config["daemon"] = before

    def dismiss(self) -> None:
        """End all free keepers."""
        with suppress(Empty):
            while True:
                self.free.get_nowait().dismiss()


def _built_in() -> list[str]:
    """The modules of all built-in methods and datasets: a worker does not know which cells it will be given."""
    every = [*plugins.installed("algorithms").values(), *plugins.installed("datasets").values()]
    entries = [plugin.entry for plugin in every if plugin.source == "matbench-stereo"]
    return [entry.module for entry in entries if not isinstance(entry, type)]


_keepers = Keepers(SimpleQueue(), Lock())
atexit.register(_keepers.dismiss)


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
    candidates = [plugins.Plugin(name, file, object) for file in files]
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
    plugin = plugins.algorithm(cell.method.algorithm, [Path(file) for file in files])
    return plugins.method_digest(plugin, plugin.make(cell.method.params))


@cache
def _scene_digest(scene: str, root: Path | None, files: tuple[str, ...]) -> str:
    """The digest of a scene as this machine has it; `files` may hold its dataset."""
    return load_scene(scene, root, files).digest
