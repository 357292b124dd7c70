"""Solving cells: what happens in the child process that a keeper watches. Here, and only here, methods run.

This process never holds truth: scenes come to it as files of views, and what recordings show besides is added by
another process. It writes what it has found into a folder of its own, which the keeper checks and takes in.
"""

import ctypes
import faulthandler
import json
import os
import resource
import signal
import sys
import traceback
from contextlib import suppress
from math import isfinite
from multiprocessing.connection import Connection
from pathlib import Path
from time import perf_counter  # by its own name: a method may put another clock into the module
from typing import Any, Literal

import numpy as np
from attrs import evolve, field, frozen
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.algorithm import Algorithm, Context, Estimate, unsupported
from matbench.errors import UserError, failure, one_line
from matbench.files.arrays import write_arrays
from matbench.measures.volumes import StoredVolume
from matbench.plans import plugins
from matbench.plans.plan import Cell, plugin_of
from matbench.plans.settings import Settings
from matbench.runs.cell_files import CONFIDENCE
from matbench.runs.outcome import DEVICE, FINAL, Outcome, Status
from matbench.scene import Scene
from matbench.scenes import kept, views_only
from matbench.solving import confinement, memory, processes
from matbench.solving.returned import checked_confidence, checked_maps, checked_volume, device_cost

_TINY = 16, 64  # rows and columns of the scene for the first, untimed solve, which compiles the kernels
OUTCOME, MAPS, VOLUME, TOLD = "outcome.json", "disparity.npz", "volume.npz", "told.npz"
"""What lies in the folder of an answer."""

_json = make_converter()


@frozen
class Job:
    """What a process needs to solve a cell. It is pickled, so it holds names and settings, no arrays.

    Parameters
    ----------
    run
        The run folder.
    threads
        How many threads the method may use.
    alone
        Is it the only cell of the run that is solved at this time? Else its seconds do not compare.
    views
        A file with the views of its scene and its size in bytes, if the run has it ready
        (`matbench.solving.ready_views`).
    """

    run: Path
    cell: Cell
    plugin_files: tuple[str, ...]
    threads: int
    settings: Settings
    alone: bool = True
    views: tuple[Path, int] | None = None


@frozen
class Order:
    """A job as its keeper hands it on: where the scene's views lie, and the folder that the answer goes to."""

    job: Job
    views: Path
    answer: Path


@frozen
class Message:
    """What this process tells its keeper, as a line of JSON.

    Parameters
    ----------
    word
        The timed solve ``begins``, it ``ends``, the answer is ``done``, or could not be written: ``lost``.
    reason
        Why it could not be written.
    is_fit
        Can this process solve another cell?
    """

    word: Literal["begins", "ends", "done", "lost"]
    reason: str = ""
    is_fit: bool = False


@frozen
class KeeperLine:
    """The line to the keeper, which counts from outside: it takes the time between ``begins`` and ``ends``."""

    line: Connection
    process: int = field(factory=os.getpid)

    def say(self, message: Message) -> None:
        if os.getpid() != self.process:  # the method has forked and both returned: only the original goes on
            os._exit(1)
        os.write(self.line.fileno(), json.dumps(_json.unstructure(message)).encode() + b"\n")

    def say_and_wait(self, word: Literal["begins", "ends"]) -> None:
        """Go on only when the keeper has counted, so that its counting disturbs nothing that is timed."""
        self.say(Message(word))
        self.line.recv_bytes()


@frozen(eq=False)
class Answer:
    """What became of a cell, with its maps and its volume where it has them."""

    outcome: Outcome
    maps: dict[int, NDArray[np.float32]] = field(factory=dict)
    volume: StoredVolume | None = None
    confidence: dict[int, NDArray[np.float32]] = field(factory=dict)


def like(scene: Scene, size: tuple[int, int]) -> Scene:
    """A scene of noise with the name, views, types and range of another, of so many rows and columns.

    Methods are compiled on it: they never see the scene that is timed before its time.
    """
    views = np.random.default_rng(0).integers(0, 256, (scene.n, *size, 3), np.uint8)
    return evolve(views_only.without_truth(scene), views=views)


def _reset_peak() -> None:
    """Let the peak of memory start anew, so that the warm-up and earlier cells do not count (Linux)."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _peak_mb() -> float:
    """Largest resident memory in MiB: since `_reset_peak` on Linux, elsewhere since the process began."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _warm_up(method: Algorithm, scene: Scene, context: Context) -> Estimate:
    """Have a method compile what it compiles; its answer for noise."""
    rows, columns = (min(a, b) for a, b in zip(_TINY, (scene.height, scene.width), strict=True))
    try:
        return method.solve(like(scene, (rows, columns)), context)
    except Exception:  # so few pixels may be too small for this method, and nobody asked for it: no failure
        return method.solve(like(scene, (scene.height, scene.width)), context)


def _solve(method: Algorithm, scene: Scene, job: Job, keeper: KeeperLine) -> Answer:
    reason = unsupported(method, scene)
    if reason:
        return Answer(Outcome("skipped", reason=reason))
    context = Context(job.cell.seed, job.threads)
    # numba compiles on the first call: a first solve of few pixels keeps that out of the timed one
    start = perf_counter()
    warm = _warm_up(method, scene, context)
    warmed = perf_counter()
    _reset_peak()
    keeper.say_and_wait("begins")
    begin = perf_counter()
    estimate = method.solve(scene, evolve(context, volume=job.settings.volumes))
    seconds = perf_counter() - begin
    peak = _peak_mb()
    keeper.say_and_wait("ends")
    maps = checked_maps(estimate, scene)
    history = {name: [v if isfinite(v) else None for v in map(float, vs)] for name, vs in estimate.history.items()}
    work = {name: int(count) for name, count in estimate.work.items()}
    volume = checked_volume(estimate, scene) if job.settings.volumes else None
    has_volume = volume is not None if job.settings.volumes else getattr(warm, "volume", None) is not None
    outcome = Outcome("ok", seconds, warmed - start, peak, job.threads, "", has_volume, work, history, alone=job.alone)
    device_seconds, device_mb = (device_cost(estimate, name) for name in DEVICE)
    outcome = evolve(outcome, device_seconds=device_seconds, device_mb=device_mb)
    if estimate.seconds != "measured":
        outcome = evolve(outcome, seconds=estimate.seconds, warmup_seconds=None, peak_mb=None, elsewhere=True)
    return Answer(outcome, maps, volume, checked_confidence(estimate, scene))


def _listen(method: Algorithm, scene: Scene, job: Job, path: Path) -> str:
    """Solve again and write down what the method tells, for a recording; why there is none, else nothing."""
    from matbench.recording import told
    from matbench.recording.probe import CapturingProbe

    assert job.settings.record is not None, "the caller has looked"  # noqa: S101
    try:
        probe = CapturingProbe(job.settings.record.at(scene.height))
        estimate = method.solve(scene, Context(job.cell.seed, job.threads, probe))
        plain = Estimate(checked_maps(estimate, scene), estimate.volume)  # the harness's own types only
        told.write_told(path, told.Told(probe, plain))
    except Exception as error:
        traceback.print_exc()
        return f"not recorded: {failure(error)}"
    return ""


def run_cell(order: Order, keeper: KeeperLine, unready: Exception | None = None) -> Outcome:
    """Solve a cell and fill the folder of its answer, whatever the method raises.

    Parameters
    ----------
    unready
        What went wrong before: then no method runs, and that is the cell's reason.
    """
    job, process, place = order.job, os.getpid(), _working_folder()
    cell, answer = job.cell, Answer(Outcome("failed"))
    try:
        if unready is not None:
            raise unready
        plugin = plugin_of(cell.method, [Path(file) for file in job.plugin_files])
        method = plugin.make(cell.method.params)
        # files may have been edited since the plan was made: results must not stand under the old digest
        if plugins.method_digest(plugin, method) != cell.method.code:
            raise UserError(f"the code of {cell.method.algorithm} is not what it was when the run was planned")
        scene = views_only.read_views(order.views)
        if plugins.scene_files(method, scene) != cell.files:
            raise UserError(f"the files that {cell.method.algorithm} reads for this scene have changed meanwhile")
        answer = _solve(method, scene, job, keeper)
        # `evolve` makes a scene whose digest is not cached: it is computed from the pixels as they are now
        if evolve(scene).digest != cell.scene_digest:
            raise ValueError("the method wrote into its input")
        _return_to(place)
        if job.settings.record is not None and not cell.repeat and answer.outcome.status == "ok":
            reason = _listen(method, scene, job, order.answer / TOLD)
            answer = evolve(answer, outcome=evolve(answer.outcome, reason=reason))
    except BaseException as error:  # a method may raise SystemExit and KeyboardInterrupt; no Ctrl-C comes here
        if os.getpid() != process:
            os._exit(1)
        traceback.print_exc()
        status, reason = _what_failed(error)
        answer = Answer(Outcome(status, threads=job.threads, reason=reason, alone=job.alone))
    finally:
        _return_to(place)
    _write(answer, order.answer)
    return answer.outcome


def _working_folder() -> Path:
    """Where relative paths lead; the root where that folder has been deleted."""
    with suppress(FileNotFoundError):
        return Path.cwd()
    return Path("/")


def _return_to(folder: Path) -> None:
    """Undo what a method has done to the working folder."""
    try:
        os.chdir(folder)
    except FileNotFoundError:
        os.chdir("/")


def _write(answer: Answer, folder: Path) -> None:
    if answer.volume is not None:
        answer.volume.write(folder / VOLUME)
    for name, maps in ((MAPS, answer.maps), (CONFIDENCE, answer.confidence)):
        if maps:
            arrays: dict[str, Any] = {f"view_{view}": values for view, values in maps.items()}
            write_arrays(folder / name, arrays)
    (folder / OUTCOME).write_text(json.dumps(_json.unstructure(answer.outcome), allow_nan=False), encoding="utf-8")


def _what_failed(error: BaseException) -> tuple[Status, str]:
    """Status and reason of a cell whose method raised."""
    reason = failure(error)
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", reason
    # OpenCV and the system raise other types where memory does not suffice
    said = one_line(error).lower()
    is_memory = isinstance(error, MemoryError) or "insufficient memory" in said or "cannot allocate memory" in said
    return "out-of-memory" if is_memory else "failed", reason


def print_to(descriptor: int) -> None:
    """Have everything that this process prints from now on, from Python or from C, go to a file descriptor."""
    os.dup2(descriptor, 1)  # descriptors 1 and 2, not only sys.stdout: C and Fortran print there
    os.dup2(descriptor, 2)
    os.close(descriptor)
    sys.stdout, sys.stderr = (
        open(number, "w", encoding="utf-8", errors="replace", buffering=1, closefd=False)  # noqa: SIM115
        for number in (1, 2)
    )


def serve(line: Connection, job: Job, confined: bool) -> None:
    """The child process: solve the cells that come in (`Order`), one by one, telling the keeper (`Message`).

    Never returns. What goes wrong before the method starts becomes the cell's reason, and stands in its log.

    Parameters
    ----------
    job
        The first cell's job: its settings give the limits of this process.
    confined
        Shut it in first (`matbench.solving.confinement`)?
    """
    unready = None
    try:
        # the keeper's handlers are inherited and are not for methods
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        if confined and not confinement.shut_in(job.run, job.settings.memory_each(), kept.folder()):
            raise RuntimeError(f"the method's process could not be shut in; {confinement.UNCONFINED}=1 does without")
        faulthandler.enable(file=2)
        memory.confine(job.settings.memory_each())
        processes.use_threads(job.threads)
    except Exception as error:
        unready = error
    os.environ[views_only.VARIABLE] = "1"
    keeper, environment = KeeperLine(line), dict(os.environ)
    with suppress(EOFError, OSError):
        while True:
            order = line.recv()
            try:
                message = Message("done", is_fit=run_cell(order, keeper, unready).status in FINAL)
            except OSError as error:
                message = Message("lost", f"{type(error).__name__}: {error}")
            _flush()
            keeper.say(message)
            # what a method changes in its environment must not reach the next cell of a shared process
            os.environ.clear()
            os.environ.update(environment)
    os._exit(0)  # without exit handlers: those that a method registered may hang


def _flush() -> None:
    """Write out what is buffered, also by C, so that it is in the log of the cell that printed it."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):  # the method may have closed or replaced it
            stream.flush()
    ctypes.CDLL(None).fflush(None)
