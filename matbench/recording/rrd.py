"""Recordings: a scene, a method's answer and what it told while it worked, in one file for the rerun viewer.

============================  ===========================================================
entity                        what it holds
============================  ===========================================================
about                         what the panels and colours mean
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

The size of a file is bounded, whatever the scene: see the constants in `matbench.recording.entities` and
`matbench.recording.reduction`. Volumes are tensors of uint8 with a slider over the rows; they are stored a
second time as fields, coarser, as rerun's `Volume3D` takes only float16. Maps are coloured here and not by the
viewer, which would draw NaN in the colour of the largest disparity.
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
from matbench.files.writing import move
from matbench.plans.record_option import RecordOption
from matbench.recording import blueprint
from matbench.recording.entities import EntityLogger, contents_text
from matbench.recording.probe import CapturingProbe
from matbench.recording.told import Told
from matbench.scene import Scene

NOTE = "matbench"
"""The property that holds a recording's table of contents."""


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
    """Run a method with a probe that keeps what it tells, and write the recording.

    The file is written under another name, read back, and then moved to `path`. So a file of that name is
    always complete.

    Parameters
    ----------
    path
        The file; if it exists, it is replaced.
    scene
        The scene with ground truth and regions, which the method need not get.
    solve
        Runs the method with the probe that this function hands it.
    title
        What the viewer calls the recording.
    wanted
        What to record, and the image rows whose epipolar planes are shown.

    Returns
    -------
    What `solve` returned.

    Raises
    ------
    RecordingError
        If what was written cannot be read back. Whatever `solve` raises is not caught.
    ValueError
        If the scene has fewer rows than those wanted.
    """
    probe = CapturingProbe(wanted.at(scene.height))
    estimate = solve(probe)
    record_told(path, scene, Told(probe, estimate), title=title)
    return estimate


def record_told(path: Path, scene: Scene, told: Told, *, title: str) -> None:
    """Write a recording of what a method told and answered elsewhere, where it had not the scene's truth.

    Raises
    ------
    RecordingError
        If what was written cannot be read back.
    """
    with staged(path) as beside:
        verify(beside, _write(beside, scene, told.probe, told.estimate, title))


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
    """A file to write to, moved to `path` when the block ends; removed if the block fails.

    In the block rerun raises its errors. By default it prints them and leaves the data out.
    """
    before = rr.strict_mode()
    # in the same folder: only within one file system is moving a file a single step
    with TemporaryDirectory(dir=path.parent, prefix=".recording-") as folder:
        beside = Path(folder) / path.name
        rr.set_strict_mode(True)
        try:
            yield beside
        finally:
            rr.set_strict_mode(before)
        move(beside, path)


def new_stream(path: Path, title: str) -> rr.RecordingStream:
    """A stream into a new file. Its rows carry the number of the pass, and no time of day.

    Without times, the same solve gives the same rows.
    """
    # the viewer remembers one blueprint for each application id: recordings that show other things need another one.
    # It accepts no other characters.
    stream = rr.RecordingStream("matbench-" + re.sub(r"[^A-Za-z0-9]+", "-", title)[:80].strip("-"))
    stream.save(path)
    stream.set_log_tick_enabled(False)
    stream.set_log_time_enabled(False)
    stream.send_recording_name(title)
    return stream


def _write(path: Path, scene: Scene, probe: CapturingProbe, estimate: Estimate | None, title: str) -> Counter[str]:
    """Write scene, answer and passes into a file; entity -> how many rows were logged."""
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
    """Read a recording back, as ``rerun rrd verify`` does, and check that no row is missing.

    Parameters
    ----------
    written
        Entity -> how many rows were logged.

    Raises
    ------
    RecordingError
        If it cannot be read, or rows are missing.
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
    if stores != (1, 1) or missing:  # one recording and one blueprint
        raise RecordingError(f"the recording is not whole: {stores} stores, missing {dict(missing)}")
