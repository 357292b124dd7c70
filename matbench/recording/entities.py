"""Writing the entities of a recording, one kind after the other. `matbench.recording.rrd` lists them all."""

from collections import Counter
from collections.abc import Sequence
from math import ceil

import numpy as np
import rerun as rr
from attrs import define, field
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.algorithm import Estimate
from matbench.measures.metrics import score
from matbench.recording import coloring, reduction, space_diagram
from matbench.recording.blueprint import Contents, EntityPath, SlicePaths
from matbench.recording.guide import ERROR_METRIC, MATERIAL, guide
from matbench.recording.perspective import Perspective, Point
from matbench.recording.probe import CapturingProbe, ColoredSlices, PassCapture, pair_label
from matbench.recording.reduction import ReducedVolume
from matbench.scene import Scene
from matbench.space import DisparitySpace, Volume, surface

# these bound the size of a recording, whatever the scene
SEEN_VOLUMES = 8  # views whose visibility is kept
PICTURE_PIXELS = 750_000  # one map
VIEWS_PIXELS = 6_000_000  # all views together
POINTS = 250_000  # of the surface
VOXELS = 100_000  # boxes in disparity space
DENSE_BYTES = 2**17  # one volume as a field: the viewer marches rays through it for every frame
PLANES = 5  # outlines of planes in disparity space: more would hide the answer
YELLOW, FAINT, THIN = (255, 221, 0), (190, 194, 202), rr.Radius.ui_points(0.75)
RAY = rr.Radius.ui_points(1.5)
# Okabe and Ito's colours: apart for every kind of eye
VIEW_COLORS = ((230, 159, 0), (86, 180, 233), (0, 158, 115), (240, 228, 66), (0, 114, 178), (213, 94, 0))

_converter = make_converter()


@define(eq=False)
class EntityLogger:
    """Logs the parts of a recording and notes what there is, for the blueprint.

    Parameters
    ----------
    probe
        What the method told.
    contents
        What has been logged.
    rows
        Entity -> how many rows were logged, for the check of the written file.
    """

    stream: rr.RecordingStream
    scene: Scene
    probe: CapturingProbe
    contents: Contents = field(factory=Contents)
    rows: Counter[str] = field(factory=Counter)

    def log(self, *path: str, what: rr.AsComponents, step: int | None = None) -> EntityPath:
        """Log an entity for all time, or at pass `step`; its path."""
        if step is not None:
            self.stream.set_time("iteration", sequence=step)
        entity = rr.new_entity_path(list(path))
        # strict: by default rerun prints errors and leaves the data out
        self.stream.log(entity, what, static=step is None, strict=True)
        self.rows[entity] += 1
        return path

    @property
    def ends(self) -> tuple[float, float]:
        return coloring.disparity_ends(self.scene)

    @property
    def shown(self) -> tuple[int, ...]:
        """The image rows whose epipolar planes are shown."""
        return self.probe.wanted.rows

    def log_picture(self, *path: str, picture: NDArray[np.uint8], step: int | None = None) -> EntityPath:
        return self.log(*path, what=rr.Image(picture), step=step)

    def log_scene(self) -> None:
        """Views, truth and regions."""
        scene, contents = self.scene, self.contents
        limit = min(PICTURE_PIXELS, VIEWS_PIXELS // scene.n)
        step = reduction.step_within(scene.height, scene.width, limit)
        for label, pixels in zip(scene.labels, scene.views, strict=True):
            contents.views.append(self.log_picture("views", label, picture=pixels[::step, ::step]))
        contents.reference = contents.views[scene.ref]
        lines = [[(0, y), (ceil(scene.width / step), y)] for y in (row / step + 0.5 for row in self.shown)]
        self.log(*contents.reference, "rows", what=rr.LineStrips2D(lines, colors=YELLOW, radii=THIN))
        if scene.ref in scene.truth:
            truth = reduction.thinned(scene.truth[scene.ref], PICTURE_PIXELS)
            self.log_picture("truth", "disparity", picture=coloring.truth_colors(truth, self.ends))
            contents.truth = True
        if scene.scored_regions:
            marked = [(0, "outside", (0, 0, 0, 0)), (1, "inside", (230, 159, 0, 255))]
            self.log("regions", what=rr.AnnotationContext(marked))
        for name, mask in scene.scored_regions.items():
            inside = rr.SegmentationImage(mask[::step, ::step].astype(np.uint8), opacity=0.6)
            contents.regions.append(self.log("regions", name, what=inside))

    def log_answer(self, estimate: Estimate) -> None:
        """The map, its error, the surface, the volumes, and the answer in disparity space."""
        scene, contents, wanted = self.scene, self.contents, self.probe.wanted
        disparity = np.asarray(estimate.disparity[scene.ref], np.float32)
        contents.estimate = True
        small = reduction.thinned(disparity, PICTURE_PIXELS)
        self.log_picture("estimate", "disparity", picture=coloring.disparity_colors(small, self.ends))
        if contents.truth:
            truth = reduction.thinned(scene.truth[scene.ref], PICTURE_PIXELS)
            self.log_picture("estimate", "error", picture=coloring.error_colors(small, truth, scene.pair_steps))
        if wanted.surface:
            self.log_surface(disparity)
        if wanted.volumes and estimate.volume is not None:
            self.log_volumes(estimate.volume)
        if wanted.volumes:
            for name, volume in self.probe.volumes.items():
                is_pair = name.startswith("similarity/")
                path = ["similarity", pair_label(name, scene.labels)] if is_pair else name.split("/")
                self.log_volume(*path, volume=volume)
        if wanted.space:
            self.log_space(estimate.volume or self.as_volume(disparity), disparity, estimate.volume is not None)

    def log_surface(self, disparity: NDArray[np.float32]) -> None:
        """A map as points in perspective, with planes of some disparities, the rays of one point, and the cameras."""
        scene, contents = self.scene, self.contents
        perspective = Perspective.of(scene)
        points, colors, radii = perspective.surface(disparity, POINTS)
        self.log("surface", what=rr.ViewCoordinates.RDF)
        self.log("surface", "points", what=rr.Points3D(points, colors=colors, radii=radii))
        for index, label in enumerate(scene.labels):
            camera = ("surface", "cameras", label)
            where = rr.Transform3D(translation=(scene.steps(index) * perspective.baseline, 0.0, 0.0))
            self.log(*camera, what=where)
            width, height = float(scene.width), float(scene.height)
            eye = rr.Pinhole(focal_length=width, width=width, height=height, image_plane_distance=0.15)
            self.log(*camera, what=eye)
        planes = np.linspace(*self.ends, PLANES).tolist()
        self.log_lines("surface", "planes", strips=[perspective.plane(d) for d in planes], names=_disparities(planes))
        at = self.pixel(disparity)
        if at is not None:
            rays = [perspective.ray(view, at, float(disparity[at])) for view in range(scene.n)]
            self.log_lines("surface", "rays", strips=rays, names=scene.labels, colored=True)
        contents.surface, contents.surface_eye = True, perspective.eye(points)

    def log_lines(self, *path: str, strips: list[list[Point]], names: Sequence[str], colored: bool = False) -> None:
        """Lines, with a name where they begin: grey for planes; if `colored`, each in the colour of its view."""
        colors = [VIEW_COLORS[i % len(VIEW_COLORS)] if colored else FAINT for i in range(len(strips))]
        radii = RAY if colored else THIN
        self.log(*path, what=rr.LineStrips3D(strips, colors=colors, radii=radii))
        # only the first and the last plane are named: more names would hide the planes
        named = range(len(strips)) if colored else sorted({0, len(strips) - 1})
        starts = rr.Points3D(
            [strips[i][0] for i in named],
            colors=[colors[i] for i in named],
            radii=radii,
            labels=[names[i] for i in named],
            show_labels=not colored,
        )
        self.log(*path, "names", what=starts)

    def pixel(self, disparity: NDArray[np.float32]) -> tuple[int, int] | None:
        """The pixel whose rays are drawn: of the first row shown, the one with an answer nearest to the middle."""
        row = self.shown[0]
        known = np.flatnonzero(np.isfinite(disparity[row]))
        if not len(known):
            return None
        return row, int(known[np.argmin(np.abs(known - self.scene.width // 2))])

    def as_volume(self, disparity: NDArray[np.float32]) -> Volume:
        """A map of the reference view as a volume, for methods that have none."""
        scene = self.scene
        views = tuple(range(scene.n)) if scene.is_even else (scene.ref,)  # a space's views lie at even steps
        space = DisparitySpace.covering(scene.disparities, len(views), scene.height, scene.width)
        return surface(space, {views.index(scene.ref): disparity}, views)

    def log_space(self, volume: Volume, disparity: NDArray[np.float32], is_material: bool) -> None:
        """The answer in disparity space: voxels, the views' frustums, some planes, and rays that meet in one point."""
        scene, contents, space = self.scene, self.contents, volume.space
        row = min(self.shown[0], space.rows - 1)
        # the space's disparities are per step of its own views
        step = volume.views[1] - volume.views[0] if len(volume.views) > 1 else 1
        whole = reduction.reduce_volume(volume, row)
        cells = space_diagram.voxels(whole, MATERIAL, VOXELS, (self.ends[0] * step, self.ends[1] * step))
        grid = rr.VoxelGridMap(cells.indices, cells.size, colors=cells.colors, translation=cells.origin)
        self.log("space", what=rr.ViewCoordinates.RDF)
        contents.space = self.log("space", "materiality" if is_material else "answer", what=grid)
        outlines = [space_diagram.frustum(space, view, row) for view in range(space.views)]
        names = [scene.labels[view] for view in volume.views]
        self.log_lines("space", "frustums", strips=outlines, names=names, colored=True)
        planes = np.unique(np.linspace(0, space.planes - 1, PLANES).round().astype(int)).tolist()
        told = _disparities([float(space.disparities[number]) / step for number in planes])
        self.log_lines("space", "planes", strips=[space_diagram.plane(space, number) for number in planes], names=told)
        at = self.pixel(disparity)
        if at is not None and scene.ref in volume.views:
            number = round(float(disparity[at]) * step * space.fineness) - space.first
            number = min(max(number, 0), space.planes - 1)
            own = volume.views.index(scene.ref)
            samples = space_diagram.target(space, own, at[1] * space.fineness, number)[1]
            rays = [space_diagram.ray(space, view, row, sample) for view, sample in enumerate(samples)]
            self.log_lines("space", "rays", strips=rays, names=names, colored=True)
        contents.space_eye = space_diagram.eye_on(space)

    def log_passes(self, estimate: Estimate) -> None:
        """The numbers of every pass, and slices, maps and errors of the passes that were kept."""
        contents, frames = self.contents, self.probe.frames
        told = dict(self.probe.energies)
        for name, values in estimate.history.items():
            told.setdefault(name, [(step, float(value)) for step, value in enumerate(values)])
        for name, points in told.items():
            for step, value in points:
                self.log("energy", name, what=rr.Scalars(value), step=step)
        contents.told = {name: [value for _, value in points] for name, points in told.items()}
        for frame in frames:
            if frame.disparity is not None:
                self._log_pass_map(frame, frame.disparity)
        contents.maps = any(frame.disparity is not None for frame in frames)
        if self.probe.wanted.slices:
            for number, row in enumerate(self.shown):
                self._log_slices(number, row, frames, estimate.volume)

    def _log_pass_map(self, frame: PassCapture, disparity: NDArray[np.float32]) -> None:
        """The map of one pass, its error, and the per cent of bad pixels in three regions."""
        scene, step = self.scene, frame.step
        self.log_picture("passes", "disparity", picture=coloring.disparity_colors(disparity, self.ends), step=step)
        if scene.ref not in scene.truth:
            return
        thin = ceil(scene.height / len(disparity))  # the probe has thinned the map; the truth must match
        truth = scene.truth[scene.ref][::thin, ::thin]
        self.log_picture(
            "passes", "error", picture=coloring.error_colors(disparity, truth, scene.pair_steps), step=step
        )
        for region in ("all", "nonocc", "occ"):
            if region in scene.regions:
                mask = scene.regions[region][::thin, ::thin]
                value = score(disparity, truth, mask, scene.pair_steps, [ERROR_METRIC])[ERROR_METRIC.name]
                if np.isfinite(value):
                    self.log("error", region, what=rr.Scalars(value), step=step)
                    self.contents.error_rates.setdefault(region, []).append(value)

    def _log_slices(self, number: int, row: int, frames: list[PassCapture], volume: Volume | None) -> None:
        """The slices of one epipolar plane: similarity, visibility, and those of the kept passes."""
        here = SlicePaths(row)

        def add(name: str, picture: NDArray[np.uint8], step: int | None = None, channels: tuple[str, ...] = ()) -> None:
            path = self.log_picture("slices", str(row), name, picture=reduction.upright(picture), step=step)
            here.paths.setdefault(name, path)
            if channels:
                here.channels[name] = list(channels)

        def colored(name: str, found: ColoredSlices | None) -> None:
            if found is not None:
                add(name, found.picture[number], channels=found.names)

        labels = self.scene.labels
        colored("similarity", self.probe.similarity(labels))
        if volume is not None:
            colored("visibility", self.probe.visibility(volume, labels))
        for frame in frames:
            if frame.materiality is not None:
                add("materiality", frame.materiality[number], frame.step)
            if frame.derivative is not None:
                add("derivative", reduction.sign_colors(frame.derivative[number]), frame.step)
        if "materiality" not in here.paths and volume is not None:
            add("materiality", reduction.as_bytes(self.probe.slices_of(volume).values[number]))
        if here.paths:
            self.contents.slices.append(here)

    def log_volumes(self, volume: Volume) -> None:
        """The volume of materiality, and the visibility that follows from it in some views."""
        row = min(self.shown[0], volume.space.rows - 1)
        self.log_volume("materiality", volume=reduction.reduce_volume(volume, row))
        seen = np.unique(np.linspace(0, volume.space.views - 1, SEEN_VOLUMES).round().astype(int))
        for index in seen.tolist():
            label = self.scene.labels[volume.views[index]]
            self.log_volume("visibility", label, volume=reduction.reduce_volume(volume, row, index))

    def log_volume(self, *name: str, volume: ReducedVolume) -> None:
        """A volume twice: as a tensor with a slider over its rows, and, coarser, as a field in space."""
        tensor = rr.Tensor(volume.values, dim_names=("row", "plane", "column"), value_range=(0, 255))
        path = self.log("volumes", *name, what=tensor)
        row = min(self.shown[0], volume.space.rows - 1)
        self.contents.volumes.append((path, (row - volume.first_row) // volume.steps[0]))
        made = space_diagram.dense(reduction.coarser(volume, row, DENSE_BYTES))
        what = rr.Volume3D(
            made.values,
            voxel_size=made.size,
            translation=made.origin,
            value_range=(0, 1),
            gamma=space_diagram.GAMMA,
            colormap="inferno",
            optical_density=made.depth,
        )
        self.contents.dense.append(self.log("haze", *name, what=what))

    def log_guide(self, title: str) -> None:
        """The text that explains the recording; last, as it depends on what there is."""
        self.contents.title, self.contents.scene = title, self.scene.digest
        self.log(
            "about", what=rr.TextDocument(guide(self.scene, self.shown, self.contents), media_type="text/markdown")
        )


def _disparities(values: list[float]) -> list[str]:
    return [f"d = {value:.3g}" for value in values]


def contents_text(contents: Contents) -> str:
    """The table of contents as JSON, to store in the recording."""
    text: str = _converter.dumps(contents)
    return text


def read_contents(text: str) -> Contents:
    """Read what `contents_text` wrote.

    Raises
    ------
    Exception
        Whatever `cattrs` or `json` raise where it is something else.
    """
    contents: Contents = _converter.loads(text, Contents)
    return contents
