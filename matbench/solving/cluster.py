"""Solving the cells of a plan on a Dask cluster.

A worker solves each cell as this machine would: in a process of its own, watched by a keeper, in a
temporary folder (`matbench.solving.cluster_worker`). It sends that folder back as bytes. Users' own files are sent to
the worker, with what they import beside them. Files that a method reads are not, as they may be large: each worker
needs them by the same path. Scenes are not sent either: the worker reads them from its own data folder, or from the one
named here if it has that, and compares digests. A worker with other code or another scene declines the cell.

A worker believes what it is sent: Dask sends tasks as pickles, so whoever can reach the scheduler can run programs on
the workers. The other way, nothing that comes is believed: a reply is bytes, which are parsed, and nothing that runs is
unpickled here (`matbench.solving.data_only`).
"""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock
from typing import Any, Literal
from uuid import uuid4

from attrs import evolve

from matbench import code
from matbench.errors import UserError, failure, one_line
from matbench.files.unzip import ArchiveError
from matbench.plans.plan import Cell, Plan
from matbench.plans.settings import Settings
from matbench.runs import parcels
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.solving import cluster_worker, processes
from matbench.solving.cluster_worker import Reply, Task
from matbench.solving.data_only import data_only, is_guarded

_PATIENCE = "10s"  # that the scheduler has to answer
_PAUSE = 0.05  # seconds between two looks at whether a reply has come


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
    with _guard(settings) as refused, _client(settings) as client:
        from distributed import as_completed

        arriving = as_completed(loop=client.loop, raise_errors=False)
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
            future = client.submit(
                cluster_worker.solve_task, task, key=(this_run, task.cell.key, len(before)), pure=False, **chosen
            )
            tasks[future.key], futures[future.key] = (task, before), future
            arriving.add(future)

        client.subscribe_topic(this_run, lambda event: begins(event[1]))
        try:
            for cell in todo:
                submit(Task(this_run, cell, (*files, *_own_file(cell)), settings), [])
            while not arriving.is_empty():
                _stop_at(refused, settings)
                # not waiting for the next one: what was refused may have been the message that it has come
                for future in arriving.next_batch(block=False) if arriving.has_ready() else _pause():
                    task, before = tasks.pop(future.key)
                    del futures[future.key]
                    reply = _reply(future)
                    _stop_at(refused, settings)
                    if isinstance(reply, Reply) and reply.declined and _other_workers(client, [*before, reply]):
                        submit(task, [*before, reply])
                        continue
                    ends(task.cell, _keep_reply(store, task.cell, future, reply, before))
        finally:
            with telling:
                waiting.clear()  # late events tell nothing any more
            client.cancel(list(futures.values()), force=True)


def _own_file(cell: Cell) -> list[tuple[str, dict[str, bytes]]]:
    """The file that a cell's method was named with, the last of its task's, if there is one."""
    file = cell.method.file
    return [(Path(file).name, _with_helpers(Path(file)))] if file else []


def _with_helpers(file: Path) -> dict[str, bytes]:
    """A user's own file and what it imports beside it: path below its folder -> content."""
    return {name: one.read_bytes() for name, one in code.of_file(file).beside(file.parent).items()}


def _other_workers(client: Any, declined: Sequence[Reply]) -> list[str]:
    """The workers that have not declined the cell; none if one declined twice: then nobody else is left to ask."""
    tried = [reply.worker for reply in declined]
    if len(set(tried)) < len(tried):
        return []
    return [worker for worker in client.scheduler_info(n_workers=-1)["workers"] if worker not in tried]


def _stop_at(refused: Sequence[str], settings: Settings) -> None:
    """Raise UserError if something was refused: who sends programs is no worker to go on with."""
    if refused:
        raise UserError(
            f"the cluster {settings.dask} sent a program, {refused[0]}, which was not run: "
            "is every worker of it yours? What is finished stays"
        )


def _pause() -> tuple[()]:
    time.sleep(_PAUSE)
    return ()


def _reply(future: Any) -> Reply | Exception | None:
    """A worker's reply; what is wrong with it, or why there is none; None if it was cancelled."""
    try:
        if future.status == "finished":
            return Reply.unpacked(future.result())
        return None if future.status == "cancelled" else future.exception()
    except Exception as error:  # of Dask, and whatever it could not read
        return error


def _keep_reply(
    store: Store, cell: Cell, future: Any, reply: Reply | Exception | None, before: Sequence[Reply]
) -> Outcome:
    """Put an arrived cell into the run folder; its outcome, or the outcome that says why none came."""
    wrong = Outcome("failed", alone=False)
    if reply is None:
        return evolve(wrong, status="interrupted", reason="the cluster has dropped it")
    if isinstance(reply, Exception):
        if future.status == "finished":
            return evolve(wrong, reason=f"a worker's answer cannot be used: {one_line(reply)}")
        return evolve(wrong, status="crashed", reason=f"no worker finished it: {failure(reply)}")
    if reply.declined:
        every = {one.declined: one.worker for one in [*before, reply]}
        return evolve(wrong, reason="; ".join(f"{why} ({worker})" for why, worker in every.items()))
    try:
        return parcels.put(store, cell, reply.parcel)
    except (ArchiveError, OSError) as error:
        return evolve(wrong, reason=f"its cell could not be written: {error}")


@contextmanager
def _guard(settings: Settings) -> Iterator[list[str]]:
    """Nothing that a cluster sends is run; the names of what was refused. A local one is this process's own."""
    if settings.dask == "local":
        yield []
        return
    with data_only() as refused:
        yield refused


async def _reads_data_only() -> bool:
    return is_guarded()


@contextmanager
def _client(settings: Settings) -> Iterator[Any]:
    """A client of the cluster that the settings name. A local cluster is started, and ends with the client."""
    try:
        from distributed import Client, LocalCluster
        from distributed.comm.addressing import resolve_address
    except ImportError as error:
        raise UserError("--dask needs Dask: pip install 'matbench-stereo[cluster]'") from error

    for name in ("distributed", "distributed.client"):  # failures are told as the cells' outcomes
        logging.getLogger(name).setLevel(logging.CRITICAL)
    cluster: Any = None
    try:
        if settings.dask == "local":
            with processes.no_daemon():
                cluster = LocalCluster(
                    n_workers=settings.jobs, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
                )
        else:
            resolve_address(settings.dask or "")  # `Client` would leave a traceback behind
        client: Any = Client(cluster or settings.dask, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # TimeoutError, too
        if settings.dask == "local" and cluster is None:
            raise UserError(f"Dask's workers cannot be started here: {one_line(error)}") from error
        if cluster is not None:
            cluster.close()
        raise UserError(
            f"Dask scheduler {settings.dask!r} cannot be reached: write tcp://HOST:PORT of one that runs, or local"
        ) from error
    patience = 2  # seconds to close after Ctrl-C, when a user will not wait; more after a whole run
    try:
        if cluster is None and not client.sync(_reads_data_only):
            raise UserError(
                "this version of Dask reads in other ways than those that are known to be safe: use another"
            )
        yield client
        patience = 10
    finally:
        for one in (client, cluster):
            if one is not None:
                with suppress(Exception):
                    one.close(timeout=patience)
                    continue
                if one is client:  # it would try again when it is forgotten, and print why it cannot
                    one.status, loop = "closed", one.loop
                    loop.add_callback(loop.stop)
