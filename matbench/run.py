"""Working through a plan: each cell in a process of its own, results as they come."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import TimeoutError as FutureTimeout
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from types import ModuleType
from typing import Literal

from pebble import ProcessExpired, ProcessPool

from matbench import plugins
from matbench.plan import Cell, Plan
from matbench.settings import Settings
from matbench.store import Outcome, Store, write_cell
from matbench.todo import pending
from matbench.worker import Job, run_cell

Event = Literal["start", "done"]
Listener = Callable[[Event, Cell, Outcome | None], None]


def threads() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def _without_main() -> Iterator[None]:
    """Keep child processes from running the user's script again: nothing that they do lies in it."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def _kernels_kept() -> Iterator[None]:
    """Let the processes started meanwhile keep compiled kernels where no other code's are."""
    before = os.environ.get("NUMBA_CACHE_DIR")
    with suppress(OSError):  # without a folder to keep them in, kernels are compiled anew
        place = plugins.kernel_cache()
        place.mkdir(parents=True, exist_ok=True)
        os.environ["NUMBA_CACHE_DIR"] = str(place)
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("NUMBA_CACHE_DIR", None)
        else:
            os.environ["NUMBA_CACHE_DIR"] = before


def run(
    plan: Plan,
    store: Store,
    settings: Settings,
    preload: Iterable[str] = (),
    listen: Listener | None = None,
) -> None:
    """Compute every cell of a plan that is not done.

    One cell at a time, so that seconds are comparable. Each is solved in a fresh process forked
    from a small server that has imported the libraries once; whatever a method does to its
    process costs that cell alone. `KeyboardInterrupt` ends the cell under way and is passed on;
    what is finished stays.

    Parameters
    ----------
    preload
        Modules that the server imports besides the harness, such as those of the methods.
    listen
        Told as each cell starts and ends.
    """
    tell = listen or (lambda *_: None)
    todo = pending(plan, store, settings)
    if not todo:
        return
    store.sweep()
    context = get_context("forkserver")
    context.set_forkserver_preload(["matbench.worker", *preload])
    with _without_main(), _kernels_kept(), ProcessPool(max_workers=1, max_tasks=1, context=context) as pool:
        try:
            for cell in todo:
                tell("start", cell, None)
                job = Job(store.folder, cell, plan.plugin_files, threads(), settings)
                outcome = _finish(pool, job, store)
                tell("done", cell, outcome)
        except BaseException:
            pool.stop()
            pool.join()
            store.sweep()
            raise


def _finish(pool: ProcessPool, job: Job, store: Store) -> Outcome:
    future = pool.schedule(run_cell, args=[job])
    try:
        while True:
            try:
                future.result(timeout=1)  # in slices: a signal is answered within a second
                break
            except FutureTimeout:
                if future.done():
                    raise
    except ProcessExpired as error:
        code = f"exit status {error.exitcode}" if error.exitcode is not None else "no exit status"
        crashed = Outcome("crashed", reason=f"the method ended its process ({code})")
        with store.building(job.cell) as draft:
            write_cell(draft, job.cell, crashed)
        return crashed
    except Exception as error:  # the disk is full, say: a method's own failure is told in its cell
        return Outcome("failed", reason=f"its cell could not be written: {type(error).__name__}: {error}")
    return store.outcome(job.cell) or Outcome("failed", reason="the cell's process left no result")
