"""Recordings: all that a solve told, its scene and its answer, as one file for the rerun viewer.

=========================  ==============================================================
entity                     what it holds
=========================  ==============================================================
about                      how to read the recording
views/LABEL                a view; in the reference view a line marks the row of the slices
truth/disparity            true disparity: dark blue is far, yellow near, grey unknown
estimate/disparity         the method's answer in the same colours, striped where it has none
estimate/error             error in pixels of the pair, from 0 to 4; grey where truth is unknown
regions/NAME               the region's mask
volumes/...                volumes as uint8 tensors (row, plane, column): what the method told
                           (``similarity/LABEL-LABEL``), ``materiality``,
                           ``visibility/LABEL``
slices/...                 one epipolar plane as in the paper's figure 2, the farthest disparity
                           at the bottom: ``similarity`` (three pairs as red, green and blue),
                           ``materiality`` (white is high) and ``derivative`` (red negative, blue
                           positive, black zero), on the iteration timeline
passes/disparity           the map of a pass, on the iteration timeline
energy/NAME                the energy of every pass, on the iteration timeline
surface/points             the answer, or a scene's truth, as points in perspective, in the
                           reference view's colours
surface/cameras/LABEL      where the views were taken
space/materiality          the volume's material points in disparity space, as voxels
space/frustums/LABEL       what a view sees of the epipolar plane shown in the slices
=========================  ==============================================================

Everything is bounded, whatever the scene: see the constants below and in `matbench.drawing`.
Volumes are tensors because their values stay uint8 and a slider walks through the epipolar planes;
rerun's ray-marched `Volume3D` takes float16 only and draws thin surfaces as haze. The volume in
space is a sparse `VoxelGridMap`. Pictures are coloured here and not by the viewer, which paints
NaN like the largest disparity.
"""

import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import rerun as rr
from attrs import define, field
from numpy.typing import NDArray
from rerun.error_utils import RerunWarning

from matbench import blueprint, coloring, drawing
from matbench.algorithm import Estimate, Probe
from matbench.blueprint import Contents, EntityPath
from matbench.drawing import Perspective, Reduced
from matbench.listening import RecordingProbe, pair_of
from matbench.scene import Scene
from matbench.space import Volume
from matbench.viewer import view

SEEN_VOLUMES = 8  # views whose visibility is kept
PICTURE_PIXELS = 750_000  # one map
VIEWS_PIXELS = 6_000_000  # all views together
POINTS = 250_000
VOXELS = 100_000
YELLOW, THIN = (255, 221, 0), rr.Radius.ui_points(0.75)
MATERIAL = 0.25  # least materiality of a drawn voxel


__all__ = ["RecordingError", "RecordingProbe", "record", "record_scene", "view"]


class RecordingError(Exception):
    """A recording that could not be written whole."""


def record(
    path: Path, scene: Scene, solve: Callable[[Probe], Estimate], *, title: str, row: int | None = None
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
    row
        The image row whose epipolar plane the slices show; the middle one if not given.

    Returns
    -------
    What `solve` returned.

    Raises
    ------
    RecordingError
        If what was written cannot be read back. Whatever `solve` raises is not caught.
    """
    row = scene.height // 2 if row is None else row
    if not 0 <= row < scene.height:
        raise ValueError(f"row {row} is not one of 0..{scene.height - 1}")
    probe = RecordingProbe(row)
    estimate = solve(probe)
    _keep(path, scene, probe, estimate, title)
    return estimate


def record_scene(path: Path, scene: Scene) -> None:
    """Write a recording of a scene alone: its views, truth, regions, and its true surface as points.

    Raises
    ------
    RecordingError
        If what was written cannot be read back.
    """
    _keep(path, scene, RecordingProbe(scene.height // 2), None, scene.name)


def _keep(path: Path, scene: Scene, probe: RecordingProbe, estimate: Estimate | None, title: str) -> None:
    """Write beside the place, check, and move there."""
    with TemporaryDirectory(dir=path.parent, prefix=".recording-") as folder:
        beside = Path(folder) / path.name
        with _strict():
            written = _write(beside, scene, probe, estimate, title)
        _verify(beside, written)
        beside.replace(path)


@contextmanager
def _strict() -> Iterator[None]:
    """Errors in what is logged are raised; by default rerun prints them and leaves the data out."""
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        yield
    finally:
        rr.set_strict_mode(before)


def _write(path: Path, scene: Scene, probe: RecordingProbe, estimate: Estimate | None, title: str) -> Counter[str]:
    """Write all there is; how many rows were logged for each entity."""
    # an identity of its own, for the viewer keeps one blueprint for each; it takes no other characters
    stream = rr.RecordingStream("matbench-" + re.sub(r"[^A-Za-z0-9]+", "-", title)[:80].strip("-"))
    stream.save(path)
    try:
        # rows carry the pass and nothing else
        stream.set_log_tick_enabled(False)
        stream.set_log_time_enabled(False)
        stream.send_recording_name(title)
        writer = _Writer(stream, scene, probe)
        writer.scene_itself(title)
        if estimate is not None:
            writer.answer(np.asarray(estimate.disparity[scene.ref], np.float32))
            writer.passes(estimate)
            if estimate.volume is not None:
                writer.material(estimate.volume)
            writer.told_volumes()
        elif scene.ref in scene.truth:
            writer.surface(scene.truth[scene.ref])
        stream.send_blueprint(blueprint.layout(writer.contents))
    finally:
        stream.disconnect()  # which also flushes
    return writer.rows


def _verify(path: Path, written: Counter[str]) -> None:
    """Read a recording back: what the command ``rerun rrd verify`` does, and that nothing is missing."""
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


@define(eq=False)
class _Writer:
    """Logs one part after the other and notes what there is for the blueprint."""

    stream: rr.RecordingStream
    scene: Scene
    probe: RecordingProbe
    contents: Contents = field(factory=Contents)
    rows: Counter[str] = field(factory=Counter)

    def log(self, *path: str, what: rr.AsComponents, step: int | None = None) -> EntityPath:
        """Log for all time, or at a pass."""
        if step is not None:
            self.stream.set_time("iteration", sequence=step)
        entity = rr.new_entity_path(list(path))
        self.stream.log(entity, what, static=step is None, strict=True)
        self.rows[entity] += 1
        return path

    @property
    def ends(self) -> tuple[float, float]:
        return coloring.disparity_ends(self.scene)

    def picture(self, *path: str, picture: NDArray[np.uint8], step: int | None = None) -> EntityPath:
        return self.log(*path, what=rr.Image(picture), step=step)

    def scene_itself(self, title: str) -> None:
        """Views, truth, regions, and how to read it all."""
        scene, contents = self.scene, self.contents
        limit = min(PICTURE_PIXELS, VIEWS_PIXELS // scene.n)
        step = drawing.step_within(scene.height, scene.width, limit)
        self.log("about", what=rr.TextDocument(_about(scene, title, self.probe.row), media_type="text/markdown"))
        for label, pixels in zip(scene.labels, scene.views, strict=True):
            contents.views.append(self.picture("views", label, picture=pixels[::step, ::step]))
        contents.reference = contents.views[scene.ref]
        y = self.probe.row / step + 0.5
        line = rr.LineStrips2D([[(0, y), (ceil(scene.width / step), y)]], colors=YELLOW, radii=THIN)
        self.log(*contents.reference, "row", what=line)
        if scene.ref in scene.truth:
            truth = drawing.thinned(scene.truth[scene.ref], PICTURE_PIXELS)
            colors = coloring.truth_colors(truth, self.ends)
            self.picture("truth", "disparity", picture=colors)
            contents.truth = True
        if scene.scored_regions:
            marked = [(0, "outside", (0, 0, 0, 0)), (1, "inside", (230, 159, 0, 255))]
            self.log("regions", what=rr.AnnotationContext(marked))
        for name, mask in scene.scored_regions.items():
            inside = rr.SegmentationImage(mask[::step, ::step].astype(np.uint8), opacity=0.6)
            contents.regions.append(self.log("regions", name, what=inside))

    def answer(self, disparity: NDArray[np.float32]) -> None:
        """The map, its error and the surface."""
        scene, contents = self.scene, self.contents
        contents.estimate = True
        small = drawing.thinned(disparity, PICTURE_PIXELS)
        self.picture("estimate", "disparity", picture=coloring.disparity_colors(small, self.ends))
        if contents.truth:
            truth = drawing.thinned(scene.truth[scene.ref], PICTURE_PIXELS)
            self.picture("estimate", "error", picture=coloring.error_colors(small, truth, scene.pair_steps))
        self.surface(disparity)

    def surface(self, disparity: NDArray[np.float32]) -> None:
        """A map as points in perspective, and where the views were taken."""
        scene, contents = self.scene, self.contents
        perspective = Perspective.of(scene)
        points, colors, radii = perspective.surface(disparity, POINTS)
        self.log("surface", what=rr.ViewCoordinates.RDF)
        self.log("surface", "points", what=rr.Points3D(points, colors=colors, radii=radii))
        for index, label in enumerate(scene.labels):
            camera = ("surface", "cameras", label)
            where = rr.Transform3D(translation=((index - scene.ref) * perspective.baseline, 0.0, 0.0))
            self.log(*camera, what=where)
            width, height = float(scene.width), float(scene.height)
            eye = rr.Pinhole(focal_length=width, width=width, height=height, image_plane_distance=0.15)
            self.log(*camera, what=eye)
        contents.surface_eye = perspective.eye(points)

    def passes(self, estimate: Estimate) -> None:
        """Energies of every pass; slices and maps of those that were kept."""
        contents, frames = self.contents, self.probe.frames
        energies = dict(self.probe.energies)
        for name, values in estimate.history.items():
            energies.setdefault(name, [(step, float(value)) for step, value in enumerate(values)])
        for name, told in energies.items():
            for step, value in told:
                self.log("energy", name, what=rr.Scalars(value), step=step)
        contents.energies = list(energies)
        similarity = self.probe.similarity()
        if similarity is not None:
            picture = drawing.upright(similarity)
            contents.slices.append(self.picture("slices", "similarity", picture=picture))
        for frame in frames:
            if frame.materiality is not None:
                picture = drawing.upright(frame.materiality)
                self.picture("slices", "materiality", picture=picture, step=frame.step)
            if frame.derivative is not None:
                picture = drawing.upright(drawing.sign_colors(frame.derivative))
                self.picture("slices", "derivative", picture=picture, step=frame.step)
            if frame.disparity is not None:
                picture = coloring.disparity_colors(frame.disparity, self.ends)
                self.picture("passes", "disparity", picture=picture, step=frame.step)
        contents.maps = any(frame.disparity is not None for frame in frames)
        if all(frame.materiality is None for frame in frames) and estimate.volume is not None:
            picture = drawing.upright(drawing.as_bytes(self.probe.slice_of(estimate.volume)))
            self.picture("slices", "materiality", picture=picture)
        for name in ("materiality", "derivative"):
            if rr.new_entity_path(["slices", name]) in self.rows:
                contents.slices.append(("slices", name))

    def material(self, volume: Volume) -> None:
        """Materiality, visibility, and the material points where they are in disparity space."""
        scene, contents, space = self.scene, self.contents, volume.space
        row = min(self.probe.row, space.rows - 1)
        whole = drawing.reduced(volume, row)
        self._volume("materiality", volume=whole)
        seen = np.unique(np.linspace(0, space.views - 1, SEEN_VOLUMES).round().astype(int))
        for index in seen.tolist():
            label = scene.labels[volume.views[index]]
            self._volume("visibility", label, volume=drawing.reduced(volume, row, index))
        step = volume.views[1] - volume.views[0]  # the space's disparities are per step of its own views
        cells = drawing.voxels(whole, MATERIAL, VOXELS, (self.ends[0] * step, self.ends[1] * step))
        grid = rr.VoxelGridMap(cells.indices, cells.size, colors=cells.colors, translation=cells.origin)
        self.log("space", what=rr.ViewCoordinates.RDF)
        self.log("space", "materiality", what=grid)
        for index, seer in enumerate(volume.views):
            outline = rr.LineStrips3D([drawing.frustum(space, index, row)], colors=YELLOW, radii=THIN)
            self.log("space", "frustums", scene.labels[seer], what=outline)
        contents.voxels, contents.space_eye = True, drawing.eye_on(space)

    def told_volumes(self) -> None:
        """What the method told; pairs of views are called by the views' labels, as all else."""
        labels = self.scene.labels
        for name, volume in self.probe.volumes.items():
            pair = pair_of(name) if name.startswith("similarity/") else None
            path = ["similarity", "-".join(labels[view] for view in pair)] if pair else name.split("/")
            self._volume(*path, volume=volume)

    def _volume(self, *name: str, volume: Reduced) -> None:
        tensor = rr.Tensor(volume.values, dim_names=("row", "plane", "column"), value_range=(0, 255))
        path = self.log("volumes", *name, what=tensor)
        row = min(self.probe.row, volume.space.rows - 1)
        self.contents.volumes.append((path, (row - volume.first_row) // volume.steps[0]))


def _about(scene: Scene, title: str, row: int) -> str:
    """How to read the recording, as markdown."""
    ends = coloring.disparity_ends(scene)
    seen = f"{scene.n} views of {scene.width}x{scene.height} px, reference view {scene.labels[scene.ref]}"
    return f"""# {title}

{scene.name}: {seen}, disparities {scene.disparities} px per view step; {scene.pair_steps:g} view steps
make the pair in whose pixels errors are given.

- **Disparity**: {ends[0]:.4g} (dark blue, far) to {ends[1]:.4g} (yellow, near); striped: no answer, grey: truth
  unknown.
- **Error**: 0 (black) to {coloring.WORST:g} px of the pair and more (pale); striped: no answer, grey: truth unknown.
- **Epipolar slices** of row {row}, the yellow line in the reference view. Columns are those of the leftmost
  view, beyond its frame too; disparity grows upward. Similarity: three pairs of views as red, green and blue.
  Materiality: white is high. Derivative of the energy: red negative (materiality wants to grow), blue
  positive, black zero.
- **Volumes** are reduced to every k-th row and column; move the slider to walk through the epipolar planes.
- **Surface**: depth is inverse to disparity, up to scale; where the range comes near 0 an offset is added first.
- **Materiality in disparity space**: points of at least {MATERIAL:g}; yellow: what each view sees of the row's plane.
"""
