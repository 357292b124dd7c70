"""One solve of which all that the method tells is kept, for a figure: in a process that has no truth."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from matbench.algorithm import Context, Estimate, unsupported
from matbench.errors import UserError, failure
from matbench.files.temporary import temporary_folder
from matbench.plans import limits
from matbench.plans.plan import Cell, plugin_of
from matbench.plans.record_option import RecordOption
from matbench.recording import told
from matbench.recording.probe import CapturingProbe
from matbench.scene import Scene
from matbench.scenes import views_only
from matbench.solving import intake, processes
from matbench.solving.apart import NoAnswer, call_apart
from matbench.solving.environment import kernel_cache_in_use, without_main
from matbench.solving.returned import checked_maps


def solve_captured(cell: Cell, files: Sequence[Path], scene: Scene, wanted: RecordOption) -> told.Told:
    """Have a process of its own solve a cell once more; what the method told, and its estimate.

    Raises
    ------
    UserError
        If the method fails, or does not support the scene.
    """
    with temporary_folder() as folder, without_main(), kernel_cache_in_use():
        views, heard = folder / "views.npz", folder / "told.npz"
        views_only.write_views(scene, views)
        processes.start_server([__name__])
        try:
            said = call_apart(_solve, (cell, files, views, heard, wanted), limits.HOUR).decode("utf-8", "replace")
        except NoAnswer as error:
            said = f"failed: {error}"
        if said:
            raise UserError(f"{cell} {said}")
        with suppress(OSError, ValueError):
            intake.take(heard, folder / "taken.npz")  # only if it is a plain file
            return told.read_told(folder / "taken.npz")
        raise UserError(f"{cell} failed: what it has told cannot be read")


def _solve(cell: Cell, files: Sequence[Path], views: Path, heard: Path, wanted: RecordOption) -> bytes:
    """In the new process: solve and write what was told; what went wrong."""
    os.environ[views_only.VARIABLE] = "1"
    try:
        scene, threads = views_only.read_views(views), limits.cores()
        processes.use_threads(threads)
        method = plugin_of(cell.method, files).make(cell.method.params)
        if reason := unsupported(method, scene):
            return f"was skipped: {reason}".encode("utf-8", "replace")
        probe = CapturingProbe(wanted.at(scene.height))
        estimate = method.solve(scene, Context(cell.seed, threads, probe))
        told.write_told(heard, told.Told(probe, Estimate(checked_maps(estimate, scene), estimate.volume)))
    except BaseException as error:  # whatever a method raises
        return f"failed: {failure(error)}".encode("utf-8", "replace")
    return b""
