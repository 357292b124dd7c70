"""One solve of which all that the method tells is kept, for a figure: in a process that has no truth."""

import os
from collections.abc import Sequence
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory

from matbench.algorithm import Context, Estimate, unsupported
from matbench.errors import UserError, failure
from matbench.plans import limits, plugins
from matbench.plans.plan import Cell
from matbench.plans.record_option import RecordOption
from matbench.recording import told
from matbench.recording.probe import CapturingProbe
from matbench.scene import Scene
from matbench.scenes import views_only
from matbench.solving import processes
from matbench.solving.environment import kernel_cache_in_use, without_main
from matbench.solving.worker import checked


def solve_captured(cell: Cell, files: Sequence[Path], scene: Scene, wanted: RecordOption) -> told.Told:
    """Have a process of its own solve a cell once more; what the method told, and its estimate.

    Raises
    ------
    UserError
        If the method fails, or does not support the scene.
    """
    with TemporaryDirectory(prefix="matbench-") as folder, without_main(), kernel_cache_in_use():
        views, heard = Path(folder) / "views.npz", Path(folder) / "told.npz"
        views_only.write_views(scene, views)
        processes.start_server([__name__])
        line, theirs = Pipe(duplex=False)
        process = get_context("forkserver").Process(target=_solve, args=(theirs, cell, files, views, heard, wanted))
        process.start()
        theirs.close()
        try:
            said = line.recv_bytes().decode()
        except EOFError:
            said = "failed: its process has ended"
        process.join()
        if said:
            raise UserError(f"{cell} {said}")
        return told.read_told(heard)


def _solve(line: Connection, cell: Cell, files: Sequence[Path], views: Path, heard: Path, wanted: RecordOption) -> None:
    """In the new process: solve, write what was told, and say what went wrong."""
    os.environ[views_only.VARIABLE] = "1"
    said = ""
    try:
        scene, threads = views_only.read_views(views), limits.cores()
        processes.use_threads(threads)
        method = plugins.algorithm(cell.method.algorithm, files).make(cell.method.params)
        if reason := unsupported(method, scene):
            said = f"was skipped: {reason}"
        else:
            probe = CapturingProbe(wanted.at(scene.height))
            estimate = method.solve(scene, Context(cell.seed, threads, probe))
            told.write_told(heard, told.Told(probe, Estimate(checked(estimate, scene), estimate.volume)))
    except BaseException as error:  # whatever a method raises
        said = f"failed: {failure(error)}"
    line.send_bytes(said.encode("utf-8", "replace"))
