"""The blueprint: which panels the viewer opens with. There are panels only for what the recording holds."""

from collections.abc import Sequence

import rerun as rr
import rerun.blueprint as rrb
from attrs import define, field

from matbench.recording.perspective import Eye

EntityPath = tuple[str, ...]  # its parts, not yet escaped: a label may hold a slash
Panel = rrb.Container | rrb.View


@define
class SlicePaths:
    """Where the slices of one epipolar plane are in a recording.

    Parameters
    ----------
    row
        The image row.
    paths
        Kind of slice -> entity path, in the order in which they are shown.
    channels
        Kind of slice -> what red, green and blue stand for.
    """

    row: int
    paths: dict[str, EntityPath] = field(factory=dict)
    channels: dict[str, list[str]] = field(factory=dict)


@define
class Contents:
    """What a recording holds: a table of contents, from which the panels are laid out.

    It is stored in the recording itself, so that two recordings can be shown side by side.

    Parameters
    ----------
    title
        What the recording is called.
    scene
        The scene's digest.
    root
        The path above all others: empty, or the side in a recording of two.
    views, reference
        Paths of all views, and that of the reference view.
    truth
        Is there ground truth, hence an error map?
    estimate
        Is there a method's answer, or only the scene?
    regions
        Paths of region masks, in the order in which they are shown.
    slices
        One for each row shown.
    volumes
        Paths of volumes, each with the index of the row to open on: the first of those with slices.
    dense
        Paths of the same volumes as fields in disparity space.
    space
        Path of the voxels in disparity space, if they are drawn.
    told
        Name -> the numbers that the method told, pass by pass, such as energies.
    error_rates
        Region -> per cent of bad pixels in the maps of single passes.
    maps
        Are there disparity maps of single passes?
    surface
        Are there points in perspective?
    surface_eye, space_eye
        Position and target of the eye in the two 3D panels.
    """

    title: str = ""
    scene: str = ""
    root: EntityPath = ()
    views: list[EntityPath] = field(factory=list)
    reference: EntityPath = ()
    truth: bool = False
    estimate: bool = False
    regions: list[EntityPath] = field(factory=list)
    slices: list[SlicePaths] = field(factory=list)
    volumes: list[tuple[EntityPath, int]] = field(factory=list)
    dense: list[EntityPath] = field(factory=list)
    space: EntityPath | None = None
    told: dict[str, list[float]] = field(factory=dict)
    error_rates: dict[str, list[float]] = field(factory=dict)
    maps: bool = False
    surface: bool = False
    surface_eye: Eye | None = None
    space_eye: Eye | None = None

    def at(self, path: Sequence[str]) -> str:
        """A path as the viewer writes it."""
        return str(rr.new_entity_path([*self.root, *path]))

    @property
    def method(self) -> str:
        """The method's name: the title without the scene."""
        return self.title.partition(" on ")[0]


def layout(contents: Contents) -> rrb.Blueprint:
    """The panels of one recording: on the left 3D panels and curves, on the right maps, slices and the rest."""
    solids, curves = _solids(contents), _curves(contents)
    left: Panel = _picture(contents, contents.reference, "Reference view")
    if solids:
        left = rrb.Vertical(contents=solids)
    if curves:
        left = rrb.Vertical(left, rrb.Tabs(contents=curves, active_tab=0), row_shares=[3, 1])
    return _blueprint(rrb.Horizontal(left, _right(contents), column_shares=[4, 5]), _has_time(contents))


def side_by_side(one: Contents, other: Contents) -> rrb.Blueprint:
    """The panels of two answers to one scene, next to each other; below, what both share, and their curves."""
    columns = []
    for contents in (one, other):
        name = f"{contents.method}: "
        rows: list[Panel] = []
        solids = _solids(contents, name)
        if solids:
            rows.append(rrb.Tabs(contents=solids, active_tab=0))
        rows.append(rrb.Horizontal(contents=_answers(contents)))
        about = rrb.TextDocumentView(origin=contents.at(("about",)), name="About")
        rows.append(rrb.Tabs(contents=[*_slices(contents), about], active_tab=0))
        columns.append(rrb.Vertical(contents=rows))
    shared: list[Panel] = [_picture(one, one.reference, "Reference view")]
    if one.truth:
        shared.append(_picture(one, ("truth", "disparity"), "True disparity"))
    curves = [curve for contents in (one, other) for curve in _curves(contents, f"{contents.method}: ")]
    if curves:
        shared.append(rrb.Tabs(contents=curves, active_tab=0))
    both = rrb.Vertical(rrb.Horizontal(contents=columns), rrb.Horizontal(contents=shared), row_shares=[4, 1])
    return _blueprint(both, _has_time(one) or _has_time(other))


def _has_time(contents: Contents) -> bool:
    return contents.maps or bool(contents.told)


def _blueprint(root: Panel, has_time: bool) -> rrb.Blueprint:
    return rrb.Blueprint(
        root,
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed" if has_time else "hidden", timeline="iteration" if has_time else None, fps=5.0),
    )


def _solids(contents: Contents, name: str = "") -> list[Panel]:
    """The 3D panels: the surface in perspective, and disparity space."""
    panels: list[Panel] = []
    if contents.surface:
        panels.append(_space(contents, [("surface",)], f"{name}Surface in perspective", contents.surface_eye))
    if contents.space is not None:
        what = contents.space[-1].capitalize()
        panels.append(_space(contents, [("space",)], f"{name}{what} in disparity space", contents.space_eye))
    return panels


def _curves(contents: Contents, name: str = "") -> list[Panel]:
    """The curves over passes. A number that was told once makes no curve; it stands in the text."""
    told = [n for n, values in contents.told.items() if len(values) > 1]
    panels: list[Panel] = []
    if "total" in told:
        panels.append(_plot(contents, [("energy", "total")], f"{name}Energy of each pass"))
    if told and told != ["total"]:
        what = "Energy and its terms" if "total" in told else f"{', '.join(told)} of each pass".capitalize()
        panels.append(_plot(contents, [("energy", n) for n in told], f"{name}{what}"))
    if any(len(values) > 1 for values in contents.error_rates.values()):
        paths = [("error", region) for region in contents.error_rates]
        panels.append(_plot(contents, paths, f"{name}Error of each pass, total_bad_1 in %"))
    return panels


def _answers(contents: Contents) -> list[Panel]:
    """The answer and its error; in a second tab, those of the pass chosen on the timeline."""
    kinds = [("disparity", "Disparity")]
    if contents.truth:
        kinds.append(("error", "Error, px of the pair"))
    panels: list[Panel] = []
    for kind, what in kinds:
        panel: Panel = _picture(contents, ("estimate", kind), what)
        if contents.maps:
            passing = _picture(contents, ("passes", kind), f"{what.partition(',')[0]} of the pass")
            panel = rrb.Tabs(panel, passing, active_tab=0)
        panels.append(panel)
    return panels


def _slices(contents: Contents) -> list[Panel]:
    """One tab for each row, its slices in at most two columns, as they are wide."""
    tabs: list[Panel] = []
    for here in contents.slices:
        pictures = [_picture(contents, path, what.capitalize()) for what, path in here.paths.items()]
        columns = 2 if len(pictures) > 2 else 1
        tabs.append(rrb.Grid(contents=pictures, grid_columns=columns, name=f"Epipolar slices, row {here.row}"))
    return tabs


def _right(contents: Contents) -> rrb.Container:
    maps: list[Panel] = [_picture(contents, contents.reference, "Reference view")]
    if contents.truth:
        maps.append(_picture(contents, ("truth", "disparity"), "True disparity"))
    if contents.estimate:
        maps += _answers(contents)
    tabs = _slices(contents)
    if contents.volumes:
        tabs.append(rrb.Tabs(contents=[_volume(contents, *volume) for volume in contents.volumes], name="Volumes"))
    if contents.dense:
        solid = [
            _space(contents, [path, ("space", "planes"), ("space", "frustums")], " ".join(path[1:]), contents.space_eye)
            for path in contents.dense
        ]
        tabs.append(rrb.Tabs(contents=solid, name="Volumes in space"))
    if contents.regions:
        regions = [_overlay(contents, path, contents.reference) for path in contents.regions]
        tabs.append(rrb.Grid(contents=regions, name="Regions"))
    views = [_picture(contents, path, f"View {path[-1]}") for path in contents.views]
    tabs.append(rrb.Grid(contents=views, name="Views"))
    tabs.append(rrb.TextDocumentView(origin=contents.at(("about",)), name="About"))
    return rrb.Vertical(
        rrb.Grid(contents=maps, grid_columns=2), rrb.Tabs(contents=tabs, active_tab=0), row_shares=[5, 4]
    )


def _plot(contents: Contents, paths: list[tuple[str, str]], name: str) -> rrb.View:
    shown = [contents.at(path) for path in paths]
    legend = rrb.PlotLegend(corner="righttop", visible=len(paths) > 1)
    return rrb.TimeSeriesView(origin=contents.at(paths[0][:1]), contents=shown, name=name, plot_legend=legend)


def _picture(contents: Contents, path: EntityPath, name: str) -> rrb.View:
    return rrb.Spatial2DView(origin=contents.at(path), name=name)


def _overlay(contents: Contents, path: EntityPath, under: EntityPath) -> rrb.View:
    """The panel of a region: its mask over the reference view."""
    return rrb.Spatial2DView(origin="/", contents=[contents.at(under), contents.at(path)], name=path[-1])


def _space(contents: Contents, shown: Sequence[EntityPath], name: str, eye: Eye | None) -> rrb.View:
    """A 3D panel of some entities and all below them, y down. Without an eye the viewer chooses one."""
    controls = eye and rrb.EyeControls3D(position=eye[0], look_target=eye[1], eye_up=(0.0, -1.0, 0.0))
    return rrb.Spatial3DView(
        origin=contents.at(shown[0]),
        contents=[f"{contents.at(path)}/**" for path in shown],
        name=name,
        eye_controls=controls,
        line_grid=rrb.LineGrid3D(visible=False),
        background=(24, 26, 30),
    )


def _volume(contents: Contents, path: EntityPath, row: int) -> rrb.View:
    """The panel of a volume: one epipolar plane, the farthest disparity at the bottom, a slider over the rows."""
    selection = rrb.TensorSliceSelection(
        width=rr.TensorDimensionSelection(dimension=2),
        height=rr.TensorDimensionSelection(dimension=1, invert=True),
        indices=[rr.TensorDimensionIndexSelection(dimension=0, index=row)],
    )
    grey = rrb.TensorScalarMapping(colormap="grayscale", mag_filter="nearest")
    return rrb.TensorView(
        origin=contents.at(path),
        name=" ".join(path[1:]),
        slice_selection=selection,
        scalar_mapping=grey,
        view_fit="fillkeepaspectratio",
    )
