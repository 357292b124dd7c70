"""One solve of `matbench check`, in a process of its own.

Three processes take part. The check starts a watcher from the fork server. The watcher forks the process
that runs the method, waits for its answer and then kills everything below itself. So a method may hang,
crash or leave processes behind, and the check goes on.
"""

import os
import tempfile
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from hashlib import sha256
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from matbench.algorithm import Context, unsupported
from matbench.errors import failure
from matbench.measures.volumes import StoredVolume
from matbench.plans import limits, plugins
from matbench.plans.plan import Method
from matbench.solving import memory, processes
from matbench.solving.check_scenes import Trial
from matbench.solving.worker import checked

_TICK = 0.05  # seconds between two looks at a process


@frozen(eq=False)
class Answer:
    """The result of one solve: maps, or the `reason` why the method declined, or an `error`.

    Parameters
    ----------
    maps
        View -> (H, W) float32, as the harness stores them; empty without an answer.
    digest
        SHA-256 of the estimate: maps, volume, history and work.
    infinite
        How many pixels of the maps were infinite; in `maps` these are NaN.
    touched
        Did the method write into the views?
    reason
        Why the method does not support the scene.
    error
        What went wrong, in a line.
    output
        What the method printed.
    """

    maps: Mapping[int, NDArray[np.float32]] = field(factory=dict)
    digest: str = ""
    infinite: int = 0
    touched: bool = False
    reason: str = ""
    error: str = ""
    output: str = ""


@contextmanager
def _printing_to(path: Path) -> Iterator[None]:
    """Send everything that this process prints, from Python or from C, to a file."""
    with path.open("w", encoding="utf-8", errors="replace", buffering=1) as log:
        kept = os.dup(1), os.dup(2)
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        try:
            with redirect_stdout(log), redirect_stderr(log):
                yield
        finally:
            for saved, number in zip(kept, (1, 2), strict=True):
                os.dup2(saved, number)
                os.close(saved)


def solve_here(method: Method, files: Sequence[Path], trial: Trial, log: Path) -> Answer:
    """Solve one trial in this process; an exception of the method becomes the answer's `error`."""
    with _printing_to(log):
        try:
            instance = plugins.algorithm(method.algorithm, files).make(method.params)
            scene, before = trial.scene, trial.views.copy()
            if reason := unsupported(instance, scene):
                return Answer(reason=reason)
            estimate = instance.solve(scene, Context(threads=trial.threads))
            touched = not np.array_equal(scene.views, before)
            maps = checked(estimate, scene)
            infinite = sum(int(np.isinf(values).sum()) for values in estimate.disparity.values())
            volume = b""
            if estimate.volume is not None:
                StoredVolume.of(estimate.volume)  # raises where it could not be kept
                volume = estimate.volume.values.tobytes()
            told = {name: [float(value) for value in values] for name, values in estimate.history.items()}
            work = {name: int(count) for name, count in estimate.work.items()}
            parts = [maps[view].tobytes() for view in sorted(maps)]
            digest = sha256(b"|".join([*parts, volume, repr((sorted(maps), told, work)).encode()])).hexdigest()
            return Answer(maps, digest, infinite, touched)
        except BaseException as error:  # whatever a method raises, SystemExit included
            traceback.print_exc()
            return Answer(error=failure(error))


def _watch(line: Connection, timeout: float, method: Method, files: Sequence[Path], trial: Trial, log: Path) -> None:
    """The watcher's process: fork a process that solves the trial, send its answer, kill all that is left."""
    processes.lead_own_session()  # Ctrl-C is for the check, which then closes the line
    answers, theirs = Pipe(duplex=False)
    watcher, pid = os.getpid(), os.fork()
    if not pid:
        try:
            processes.die_with_parent(watcher)
            for ours in (line, answers):
                ours.close()
            memory.confine(limits.room())
            memory.fill_fresh(trial.garbage)
            own, found = os.getpid(), solve_here(method, files, trial, log)
            if os.getpid() == own:  # else this is a copy that the method has forked, and not the one to answer
                theirs.send(found)
                os._exit(0)
        finally:
            os._exit(1)
    theirs.close()
    try:
        with suppress(OSError):  # the check has gone
            line.send(_heard(answers, line, pid, timeout))
    finally:
        processes.kill_descendants()


def _heard(answers: Connection, line: Connection, pid: int, timeout: float) -> Answer:
    """The answer of process `pid`; else an answer that says how it ended, or that the time was up."""
    end, sources = time.monotonic() + timeout, [answers, line]
    while time.monotonic() < end:
        # first whether it has ended, then what it sent: so an answer sent just before the end is not missed
        ended = processes.reap().get(pid)
        ready = wait(sources, _TICK if ended is None else 0)
        if line in ready:
            return Answer(error="nobody wants to know")
        if answers in ready:
            try:
                found: Answer = answers.recv()
                return found
            except EOFError:
                sources.remove(answers)
        if ended is not None:
            code = os.waitstatus_to_exitcode(ended)
            how = f"signal {-code}" if code < 0 else f"exit status {code}"
            return Answer(error=f"the method ended its process ({how})")
    return Answer(error=f"no answer within {timeout:g} s")


def solve_apart(method: Method, files: Sequence[Path], trial: Trial, timeout: float) -> Answer:
    """Solve one trial in a process of its own, which may hang, crash, or leave others behind.

    Parameters
    ----------
    files
        The users' own files with methods.
    timeout
        Seconds that the solve may take.
    """
    with tempfile.TemporaryDirectory(prefix="matbench-check-") as folder:
        log = Path(folder) / "log.txt"
        line, theirs = Pipe()
        process = get_context("forkserver").Process(target=_watch, args=(theirs, timeout, method, files, trial, log))
        process.start()
        theirs.close()
        try:
            found: Answer = line.recv()
        except EOFError:
            found = Answer(error="the method ended the process that watches it")
        finally:
            line.close()
            process.join()
        said = log.read_bytes()[-2000:].decode("utf-8", "replace").strip() if log.exists() else ""
        return evolve(found, output=said)
