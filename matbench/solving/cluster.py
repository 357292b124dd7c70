"""The cells of a plan handed out by a Dask cluster.

Every worker solves its cells as they are solved here: each in a process of its own, watched by a keeper,
in a folder of the worker's own. What comes back is that folder, as bytes. Scenes are not sent: a worker
finds them in its own data folder, or in the one that is named here if it can see it, and compares
digests. Users' own files of methods are sent. Dask itself exchanges tasks as pickles: whoever can reach
its scheduler can run programs on the workers.
"""

import atexit
import logging
from collections.abc import Callable, Iterator, Sequence
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

from matbench.errors import UserError
from matbench.files.unzip import ArchiveError
from matbench.plans import plugins
from matbench.plans.limits import cores
from matbench.plans.plan import Cell, Plan
from matbench.plans.settings import Settings
from matbench.runs import parcels
from matbench.runs.store import Outcome, Store
from matbench.scenes.catalogue import data_root, load_scene
from matbench.solving.keeper import Keeper
from matbench.solving.worker import Job
from matbench.spec import first_line

_PATIENCE = "10s"  # to reach the scheduler
_LOOK = 0.2  # seconds between two looks at whether a task is still wanted


@frozen
class Task:
    """A cell on its way to a worker.

    Parameters
    ----------
    run
        Distinguishes what belongs to one run from all else on the cluster.
    files
        Name and content of the users' own files that hold methods.
    """

    run: str
    cell: Cell
    files: tuple[tuple[str, bytes], ...]
    settings: Settings


@frozen
class Reply:
    """What a worker has to say of a cell: the cell, or why it has declined it.

    Parameters
    ----------
    worker
        The worker's address.
    """

    worker: str
    parcel: bytes = b""
    declined: str = ""


def work(
    plan: Plan,
    store: Store,
    settings: Settings,
    todo: Sequence[Cell],
    tell: Callable[[Literal["start", "done"], Cell, Outcome | None], None],
) -> None:
    """Have a cluster compute cells; each is put in its place as it comes, whole.

    A cell that a worker declines goes to another one; one whose workers die is tried again on
    others, a few times. `KeyboardInterrupt` stops what runs, on the workers too.

    Raises
    ------
    UserError
        If the cluster cannot be had.
    """
    if settings.dask == "local":
        settings = evolve(settings, threads=settings.threads_each(), memory=settings.memory_each())
    files = tuple((Path(file).name, Path(file).read_bytes()) for file in plan.plugin_files)
    with _client(settings) as client:
        from distributed import as_completed

        arriving = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        this_run = f"matbench-{uuid4().hex}"
        waiting = {cell.key: cell for cell in todo}
        telling = Lock()  # that a cell starts is heard in a thread of the client
        tasks: dict[str, tuple[Task, list[Reply]]] = {}
        futures: dict[str, Any] = {}

        def begins(key: str) -> None:
            with telling:
                if (cell := waiting.pop(key, None)) is not None:
                    tell("start", cell, None)

        def ends(cell: Cell, outcome: Outcome) -> None:
            begins(cell.key)
            with telling:
                tell("done", cell, outcome)

        def submit(task: Task, before: list[Reply]) -> None:
            chosen = {"workers": _others(client, before), "allow_other_workers": True} if before else {}
            future = client.submit(solve, task, key=(this_run, task.cell.key, len(before)), pure=False, **chosen)
            tasks[future.key], futures[future.key] = (task, before), future
            arriving.add(future)

        client.subscribe_topic(this_run, lambda event: begins(event[1]))
        try:
            for cell in todo:
                submit(Task(this_run, cell, files, settings), [])
            for future, reply in arriving:
                task, before = tasks.pop(future.key)
                del futures[future.key]
                if future.status == "finished" and reply.declined and _others(client, [*before, reply]):
                    submit(task, [*before, reply])
                    continue
                ends(task.cell, _arrived(store, task.cell, future, reply, before))
        finally:
            with telling:
                waiting.clear()
            client.cancel(list(futures.values()), force=True)


def _others(client: Any, declined: Sequence[Reply]) -> list[str]:
    """The workers that have not declined; none once one of them has declined twice."""
    tried = [reply.worker for reply in declined]
    if len(set(tried)) < len(tried):
        return []
    return [worker for worker in client.scheduler_info(n_workers=-1)["workers"] if worker not in tried]


def _arrived(store: Store, cell: Cell, future: Any, reply: Any, before: Sequence[Reply]) -> Outcome:
    """Put what came in its place, or say why nothing came."""
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
    failure = reply[1] if isinstance(reply, tuple) else reply
    said = f"{type(failure).__name__}: {first_line(failure)}"
    return evolve(wrong, status="crashed", reason=f"no worker finished it: {said}")


@contextmanager
def _client(settings: Settings) -> Iterator[Any]:
    """A client of the cluster that the settings name; a local cluster ends with it."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise UserError("--dask needs Dask: pip install 'matbench-stereo[cluster]'") from error

    for name in ("distributed", "distributed.client"):  # what goes wrong is told in the cells
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
    patience = 2  # who interrupts will not wait for long
    try:
        yield client
        patience = 10
    finally:
        for one in (client, cluster):
            if one is not None:
                with suppress(Exception):
                    one.close(timeout=patience)


# on the workers


def solve(task: Task) -> Reply:
    """Solve a cell on a Dask worker."""
    from distributed import get_worker

    worker = get_worker()
    with TemporaryDirectory(prefix="matbench-") as folder:
        files = _written(task.files, Path(folder))
        root = _data(task.settings.data)
        why = _unlike(task.cell, files, root)
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
        outcome = _solved(job, worker, worker.get_current_task())
        if not store.cell(task.cell).exists():
            return Reply(worker.address, declined=outcome.reason)
        return Reply(worker.address, parcels.pack(store.cell(task.cell)))


def _solved(job: Job, worker: Any, key: Any) -> Outcome:
    """Have a keeper solve a cell; it is dismissed where nobody wants the cell any more."""
    keeper = _keepers.get()
    lives = False
    try:
        keeper.take(job)
        while not keeper.line.poll(_LOOK):
            wanted = worker.state.tasks.get(key)
            if wanted is None or wanted.state != "executing":
                return Outcome("interrupted", reason="nobody wants it any more")
        outcome, lives = keeper.done(job)
        return outcome
    finally:
        if lives:
            _keepers.free.put(keeper)
        else:
            keeper.dismiss()
            keeper.wait()


@define
class Keepers:
    """The keepers of this worker: as many as cells have run at once."""

    free: "SimpleQueue[Keeper]"
    starting: Lock

    def get(self) -> Keeper:
        """A free one, or a new one."""
        with suppress(Empty):
            return self.free.get_nowait()
        from matbench.runs.provenance import commit_known
        from matbench.solving.environment import kernels_kept, without_main

        # Dask's workers are daemons, which may have no children lest they leave orphans; keepers end with their parent
        with self.starting, without_main(), kernels_kept(), commit_known():
            config = current_process()._config  # type: ignore[attr-defined]
            before = config.get("daemon")
            config["daemon"] = False
            try:
                return Keeper(_built_in())
            finally:
                config["daemon"] = before

    def dismiss(self) -> None:
        with suppress(Empty):
            while True:
                self.free.get_nowait().dismiss()


def _built_in() -> list[str]:
    every = [*plugins.installed("algorithms").values(), *plugins.installed("datasets").values()]
    entries = [plugin.entry for plugin in every if plugin.source == "matbench-stereo"]
    return [entry.module for entry in entries if not isinstance(entry, type)]


_keepers = Keepers(SimpleQueue(), Lock())
atexit.register(_keepers.dismiss)


def _written(files: Sequence[tuple[str, bytes]], folder: Path) -> tuple[str, ...]:
    """The paths of users' files as they came, each in a folder of its own; their names count in digests."""
    paths = []
    for number, (name, content) in enumerate(files):
        if Path(name).name != name:
            raise ValueError(f"{name!r} is no file name")
        path = folder / str(number) / name
        path.parent.mkdir()
        path.write_bytes(content)
        paths.append(str(path))
    return tuple(paths)


def _data(named: Path | None) -> Path | None:
    """This worker's folder of real scenes: its own, else the one named by whoever asks, if it is here."""
    with suppress(UserError):
        own = data_root()
        if own is not None:
            return own
    return named if named is not None and named.is_dir() else None


def _unlike(cell: Cell, files: Sequence[str], root: Path | None) -> str:
    """Why this worker would solve something else: it has other code, or not the scene; empty if it would not."""
    name, known = cell.method.algorithm, plugins.installed("algorithms")
    candidates = [plugins.Plugin(name, file, object) for file in files]
    candidates += [known[name]] if name in known else []
    if not candidates:
        return f"the worker has no method {name}: install what offers it there"
    try:
        is_same = cell.method.code in map(plugins.code_digest, candidates) or cell.method.code == _code(cell, files)
    except (ImportError, OSError, UserError) as error:
        return f"the worker cannot use {name}: {first_line(error)}"
    if not is_same:
        return f"the worker has other code of {name}, or other versions of numpy, numba or OpenCV: install the same"
    try:
        if _digest(cell.scene, root) != cell.scene_digest:
            return f"the worker's {cell.scene} is another one: give all workers the same data"
    except Exception as error:
        return f"the worker has not {cell.scene}: {first_line(error)}"
    return ""


def _code(cell: Cell, files: Sequence[str]) -> str:
    """The digest of a cell's method, and of the files that it names: to know these, the method is imported."""
    plugin = plugins.algorithm(cell.method.algorithm, [Path(file) for file in files])
    return plugins.method_digest(plugin, plugin.make(cell.method.params))


@cache
def _digest(scene: str, root: Path | None) -> str:
    """A scene's digest on this machine."""
    return load_scene(scene, root).digest
