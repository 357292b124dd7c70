"""Solving cells, in a process that a keeper watches."""

import ctypes
import faulthandler
import json
import os
import resource
import signal
import sys
import time
import traceback
from contextlib import suppress
from math import isfinite
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.algorithm import Algorithm, Context, Estimate, unsupported
from matbench.errors import UserError
from matbench.measures.volumes import StoredVolume
from matbench.plans import plugins
from matbench.plans.plan import Cell
from matbench.plans.settings import Settings
from matbench.runs.store import FINAL, Outcome, Status, write_cell
from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene
from matbench.solving import processes
from matbench.spec import first_line

_TINY = 16, 64  # rows and columns of the scene that methods are compiled on


@frozen
class Job:
    """All that a cell's process needs; small, no arrays.

    Parameters
    ----------
    run
        The run folder.
    threads
        How many the method is given.
    alone
        Does no other cell of the run run meanwhile?
    """

    run: Path
    cell: Cell
    plugin_files: tuple[str, ...]
    threads: int
    settings: Settings
    alone: bool = True


def tiny(scene: Scene) -> Scene:
    """A corner of a scene: same views, types and range, few pixels."""
    rows, columns = (min(a, b) for a, b in zip(_TINY, (scene.height, scene.width), strict=True))
    return evolve(
        scene,
        views=scene.views[:, :rows, :columns],
        truth={view: truth[:rows, :columns] for view, truth in scene.truth.items()},
        regions={name: mask[:rows, :columns] for name, mask in scene.regions.items()},
        visible={view: seen[:, :rows, :columns] for view, seen in scene.visible.items()},
    )


def hide_truth(scene: Scene) -> Scene:
    """The scene as a method may see it: no ground truth and nothing that follows from it, no view held out."""
    return evolve(scene, truth={}, regions={}, visible={}, held_out=None)


def checked(estimate: Any, scene: Scene) -> dict[int, NDArray[np.float32]]:
    """The disparity maps of an estimate as float32; infinities become NaN.

    Raises
    ------
    TypeError, ValueError
        If the method returned something else than an `Estimate` with whole maps.
    """
    if not isinstance(estimate, Estimate):
        raise TypeError(f"solve returned {type(estimate).__name__}, not an Estimate")
    if scene.ref not in estimate.disparity:
        raise ValueError(f"the estimate has no disparity map of the reference view {scene.ref}")
    maps = {}
    for view, values in estimate.disparity.items():
        array = np.asarray(values)
        if not 0 <= view < scene.n:
            raise ValueError(f"the estimate has a map of view {view}, the scene has {scene.n} views")
        if array.shape != (scene.height, scene.width) or array.dtype.kind not in "fiu":
            expected = f"{(scene.height, scene.width)} numbers"
            raise ValueError(f"the map of view {view} is {array.shape} {array.dtype}, not {expected}")
        single = array.astype(np.float32)
        maps[int(view)] = np.where(np.isfinite(single), single, np.float32(np.nan))
    return maps


def _reset_peak() -> None:
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _peak_mb() -> float:
    """Largest resident memory since `_reset_peak` (Linux), else since the process began, in MiB."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _volume(estimate: Estimate, scene: Scene) -> StoredVolume | None:
    """The estimate's volume as it is kept; None where it has none of that kind, which is said in the log."""
    if estimate.volume is None:
        return None
    try:
        volume = StoredVolume.of(estimate.volume)
        if volume.views[-1] >= scene.n or (volume.space.rows, volume.space.width) != (scene.height, scene.width):
            raise ValueError(f"the volume spans the views {volume.views} of {volume.space}, which is another scene")
    except (ValueError, TypeError, AttributeError) as error:
        print(f"volume not kept: {type(error).__name__}: {error}")
        return None
    return volume


def _solve(
    method: Algorithm, scene: Scene, job: Job
) -> tuple[Outcome, dict[int, NDArray[np.float32]] | None, StoredVolume | None]:
    if reason := unsupported(method, scene):
        return Outcome("skipped", reason=reason), None, None
    context = Context(job.cell.seed, job.threads)
    start = time.perf_counter()
    try:
        warm = method.solve(tiny(scene), context)
    except Exception:  # too small for this method, which nobody asked it to solve
        warm = method.solve(scene, context)
    warmed = time.perf_counter()
    _reset_peak()
    begin = time.perf_counter()
    estimate = method.solve(scene, evolve(context, volume=job.settings.volumes))
    seconds = time.perf_counter() - begin
    peak = _peak_mb()
    maps = checked(estimate, scene)
    history = {name: [v if isfinite(v) else None for v in map(float, vs)] for name, vs in estimate.history.items()}
    work = {name: int(count) for name, count in estimate.work.items()}
    volume = _volume(estimate, scene) if job.settings.volumes else None
    has_volume = volume is not None if job.settings.volumes else getattr(warm, "volume", None) is not None
    outcome = Outcome("ok", seconds, warmed - start, peak, job.threads, "", has_volume, work, history, alone=job.alone)
    return outcome, maps, volume


def _record(method: Algorithm, job: Job, path: Path, outcome: Outcome) -> Outcome:
    """Solve again, recorded; the outcome with what was, or why there is no recording: the answer itself stands."""
    from matbench.recording.rrd import record

    assert job.settings.record is not None, "the caller has looked"  # noqa: S101
    scene = load_scene(job.cell.scene, job.settings.data)
    wanted = job.settings.record.at(scene.height)

    def solve(probe: Any) -> Estimate:
        return method.solve(hide_truth(scene), Context(job.cell.seed, job.threads, probe))

    try:
        record(path, scene, solve, title=str(job.cell), wanted=wanted)
    except Exception as error:
        traceback.print_exc()
        return evolve(outcome, reason=f"not recorded: {type(error).__name__}: {first_line(error)}")
    return evolve(outcome, recorded=wanted)


def run_cell(job: Job, draft: Path) -> Outcome:
    """Solve a cell and fill its folder, whatever the method raises."""
    cell, process, place = job.cell, os.getpid(), Path.cwd()
    maps = volume = None
    try:
        plugin = plugins.algorithm(cell.method.algorithm, [Path(file) for file in job.plugin_files])
        method = plugin.make(cell.method.params)
        if plugins.method_digest(plugin, method) != cell.method.code:
            raise UserError(f"the code of {cell.method.algorithm} is not what it was when the run was planned")
        scene = hide_truth(load_scene(cell.scene, job.settings.data))
        if scene.digest != cell.scene_digest:
            raise UserError(f"{cell.scene} is not what it was when the run was planned")
        outcome, maps, volume = _solve(method, scene, job)
        if os.getpid() != process:  # a copy that the method made of its process
            os._exit(1)
        if evolve(scene).digest != cell.scene_digest:
            raise ValueError("the method wrote into its input")
        os.chdir(place)
        if job.settings.record is not None and not cell.repeat and outcome.status == "ok":
            outcome = _record(method, job, draft / "recording.rrd", outcome)
    except BaseException as error:  # SystemExit and KeyboardInterrupt, too: no signal comes here
        if os.getpid() != process:
            os._exit(1)
        traceback.print_exc()
        status, reason = _what_failed(error)
        outcome = Outcome(status, threads=job.threads, reason=reason, alone=job.alone)
        maps = volume = None
    finally:
        os.chdir(place)
    write_cell(draft, cell, outcome, maps, volume)
    return outcome


def _what_failed(error: BaseException) -> tuple[Status, str]:
    if isinstance(error, MemoryError):
        return "out-of-memory", f"MemoryError: {error}"
    reason = f"{type(error).__name__}: {first_line(error)}"
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", reason
    is_memory = any(words in str(error).lower() for words in ("insufficient memory", "cannot allocate memory"))
    return "out-of-memory" if is_memory else "failed", reason


def serve(line: Connection, printed: int, job: Job) -> None:
    """Solve the cells that come in, one by one. Never returns.

    The answer to each is a line of JSON: "", or why it could not be written, and whether this process is fit
    for another one.

    Parameters
    ----------
    printed
        The file descriptor for all that this process prints, from Python or from C.
    job
        The first of them, by whose settings the process is confined.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.dup2(printed, 1)
    os.dup2(printed, 2)
    os.close(printed)
    sys.stdout, sys.stderr = (
        open(number, "w", encoding="utf-8", errors="replace", buffering=1, closefd=False)  # noqa: SIM115
        for number in (1, 2)
    )
    faulthandler.enable(file=2)
    processes.confine(job.settings.memory_each())
    processes.use_threads(job.threads)
    environment = dict(os.environ)
    with suppress(EOFError, OSError):
        while True:
            job, draft = line.recv()
            try:
                said, is_fit = "", run_cell(job, draft).status in FINAL
            except OSError as error:
                said, is_fit = f"{type(error).__name__}: {error}", False
            _flush()
            os.write(line.fileno(), json.dumps([said, is_fit]).encode() + b"\n")
            os.environ.clear()
            os.environ.update(environment)
    os._exit(0)


def _flush() -> None:
    """Send on what was printed, from C too."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):  # the method may have closed or replaced it
            stream.flush()
    ctypes.CDLL(None).fflush(None)
