"""Recordings: all that a solve told, its scene and its answer, as one file for the rerun viewer.

============================  ===========================================================
entity                        what it holds
============================  ===========================================================
about                         how to read the recording
views/LABEL                   a view; in the reference view lines mark the rows of the slices
truth/disparity               true disparity: dark blue is far, yellow near, grey unknown
estimate/disparity            the method's answer in the same colours, striped where it has none
estimate/error                error in pixels of the pair, from 0 to 4; grey where truth is unknown
regions/NAME                  the region's mask
slices/ROW/...                epipolar planes as in the paper's figure 2, the farthest disparity
                              at the bottom: ``similarity`` of three pairs and ``visibility`` in three
                              views as red, green and blue, ``materiality`` (white is high) and
                              ``derivative`` (red negative, blue positive, black zero)
passes/disparity, .../error   the map of a pass and its error, on the iteration timeline
energy/NAME                   what the method told of every pass, on the iteration timeline
error/REGION                  total_bad_1 of the maps of passes, on the iteration timeline
volumes/...                   volumes as uint8 tensors (row, plane, column): what the method told
                              (``similarity/LABEL-LABEL``), ``materiality``, ``visibility/LABEL``
haze/...                      the same, coarser, as fields in disparity space
surface/points                the answer, or a scene's truth, as points in perspective, in the
                              reference view's colours
surface/cameras/LABEL         where the views were taken
surface/planes, .../rays      planes of constant disparity; the rays on which views see one point
space/materiality             the volume's material points in disparity space, as voxels;
                              ``space/answer`` where the method has no volume
space/planes, .../rays        some of its planes; the rays of all views that meet in one target point
space/frustums                what each view sees of the epipolar plane of the first row
============================  ===========================================================

Everything is bounded, whatever the scene: see the constants in `matbench.recording.entities` and
`matbench.recording.reduction`. Tensors keep their values as uint8 and have a slider through the epipolar
planes; rerun's ray-marched `Volume3D` takes float16 only. Pictures are coloured here and not by
the viewer, which paints NaN like the largest disparity.
"""

import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import rerun as rr
from rerun.error_utils import RerunWarning

from matbench.algorithm import Estimate, Probe
from matbench.plans.record_option import RecordOption
from matbench.recording import blueprint
from matbench.recording.entities import EntityLogger, contents_text
from matbench.recording.probe import CapturingProbe
from matbench.scene import Scene

NOTE = "matbench"
"""The property under which a recording notes what it holds."""


class RecordingError(Exception):
    """A recording that could not be written whole."""


def record(
    path: Path,
    scene: Scene,
    solve: Callable[[Probe], Estimate],
    *,
    title: str,
    wanted: RecordOption = RecordOption(),  # noqa: B008 -- frozen
) -> Estimate:
    """Solve once more, listening, and write what was told to `path`.

    The file is written beside its place, read back whole and then moved there: under its own name
    it is complete or it is not there.

    Parameters
    ----------
    path
        Where the recording goes; a file of that name is replaced.
    scene
        With its ground truth and regions, which the method need not see.
    solve
        Runs the method with the probe that it is given.
    title
        What the viewer calls the recording.
    wanted
        What is recorded, and the image rows whose epipolar planes are shown.

    Returns
    -------
    What `solve` returned.

    Raises
    ------
    RecordingError
        If what was written cannot be read back. Whatever `solve` raises is not caught.
    ValueError
        If the scene has not the rows.
    """
    probe = CapturingProbe(wanted.at(scene.height))
    estimate = solve(probe)
    with staged(path) as beside:
        verify(beside, _write(beside, scene, probe, estimate, title))
    return estimate


def record_scene(path: Path, scene: Scene) -> None:
    """Write a recording of a scene alone: its views, truth, regions, and its true surface as points.

    Raises
    ------
    RecordingError
        If what was written cannot be read back.
    """
    with staged(path) as beside:
        verify(beside, _write(beside, scene, CapturingProbe(RecordOption().at(scene.height)), None, scene.name))


@contextmanager
def staged(path: Path) -> Iterator[Path]:
    """A place beside `path` to write to, moved there when the block ends, gone if it fails.

    Errors in what is logged meanwhile are raised; by default rerun prints them and leaves the data out.
    """
    before = rr.strict_mode()
    with TemporaryDirectory(dir=path.parent, prefix=".recording-") as folder:
        beside = Path(folder) / path.name
        rr.set_strict_mode(True)
        try:
            yield beside
        finally:
            rr.set_strict_mode(before)
        beside.replace(path)


def new_stream(path: Path, title: str) -> rr.RecordingStream:
    """A stream into a new file, whose rows carry the pass and nothing else."""
    # an identity of its own, for the viewer keeps one blueprint for each; it takes no other characters
    stream = rr.RecordingStream("matbench-" + re.sub(r"[^A-Za-z0-9]+", "-", title)[:80].strip("-"))
    stream.save(path)
    stream.set_log_tick_enabled(False)
    stream.set_log_time_enabled(False)
    stream.send_recording_name(title)
    return stream


def _write(path: Path, scene: Scene, probe: CapturingProbe, estimate: Estimate | None, title: str) -> Counter[str]:
    """Write all there is; how many rows were logged for each entity."""
    stream = new_stream(path, title)
    try:
        logger = EntityLogger(stream, scene, probe)
        logger.log_scene()
        if estimate is not None:
            logger.log_answer(estimate)
            logger.log_passes(estimate)
        elif scene.ref in scene.truth:
            logger.log_surface(scene.truth[scene.ref])
        logger.log_guide(title)
        stream.send_property(NOTE, rr.AnyValues(contents=contents_text(logger.contents)))
        stream.send_blueprint(blueprint.layout(logger.contents))
    finally:
        stream.disconnect()  # which also flushes
    return logger.rows


def verify(path: Path, written: Counter[str]) -> None:
    """Read a recording back: what the command ``rerun rrd verify`` does, and that nothing is missing.

    Raises
    ------
    RecordingError
        If it is not whole.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RerunWarning)  # a file cut short gives a warning only
            reader = rr.chunk.RrdReader(path)
            stores = len(reader.recordings()), len(reader.blueprints())
            found: Counter[str] = Counter()
            for chunk in reader.stream():
                found[chunk.entity_path] += chunk.num_rows
    except (RuntimeError, ValueError, Warning) as error:
        raise RecordingError(f"the recording cannot be read back: {error}") from error
    missing = written - found
    if stores != (1, 1) or missing:
        raise RecordingError(f"the recording is not whole: {stores} stores, missing {dict(missing)}")
