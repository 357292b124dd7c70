"""What a recording shows when it opens."""

import rerun as rr
import rerun.blueprint as rrb
from attrs import define, field

from matbench.drawing import Eye

EntityPath = tuple[str, ...]  # part by part


@define
class Contents:
    """What a recording holds: panels exist only for what is there.

    Parameters
    ----------
    views
        Paths of all views.
    reference
        Path of the reference view.
    truth
        Is there ground truth, hence an error map?
    estimate
        Is there a method's answer, or only a scene?
    regions, slices
        Paths of region masks and epipolar slices, in the order in which they are shown.
    volumes
        Paths of volumes, each with the row to open on: the one of the slices.
    voxels
        Is there a materiality volume, drawn in disparity space?
    energies
        Names of energies on the iteration timeline.
    maps
        Are there disparity maps of single passes?
    surface_eye, space_eye
        Position and target of the eye in the two 3D panels.
    """

    views: list[EntityPath] = field(factory=list)
    reference: EntityPath = ()
    truth: bool = False
    estimate: bool = False
    regions: list[EntityPath] = field(factory=list)
    slices: list[EntityPath] = field(factory=list)
    volumes: list[tuple[EntityPath, int]] = field(factory=list)
    voxels: bool = False
    energies: list[str] = field(factory=list)
    maps: bool = False
    surface_eye: Eye | None = None
    space_eye: Eye | None = None


def layout(contents: Contents) -> rrb.Blueprint:
    """Left the surface, the volume and the energies; right the maps, the slices and all the rest."""
    has_time = contents.maps or bool(contents.energies or contents.slices)
    return rrb.Blueprint(
        rrb.Horizontal(_left(contents), _right(contents), column_shares=[4, 5]),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed" if has_time else "hidden", timeline="iteration" if has_time else None, fps=5.0),
    )


def _left(contents: Contents) -> rrb.Container | rrb.View:
    if not (contents.estimate or contents.truth):
        return _picture(contents.reference, "Reference view")
    solid: rrb.Container | rrb.View = _space("surface", "Surface", contents.surface_eye)
    if contents.voxels:
        solid = rrb.Vertical(solid, _space("space", "Materiality in disparity space", contents.space_eye))
    if not contents.energies:
        return solid
    plots = [_plot("/energy", "Energy and its terms")]
    if "total" in contents.energies:
        plots.insert(0, _plot("/energy/total", "Energy of each pass"))
    return rrb.Vertical(solid, rrb.Tabs(contents=plots, active_tab=0), row_shares=[3, 1])


def _plot(origin: str, name: str) -> rrb.View:
    return rrb.TimeSeriesView(origin=origin, name=name, plot_legend=rrb.PlotLegend(corner="righttop"))


def _right(contents: Contents) -> rrb.Container:
    estimate: rrb.Container | rrb.View = _picture(("estimate", "disparity"), "Disparity")
    if contents.maps:
        estimate = rrb.Tabs(estimate, _picture(("passes", "disparity"), "Disparity of the pass"))
    maps: list[rrb.Container | rrb.View] = [_picture(contents.reference, "Reference view")]
    if contents.truth:
        maps.append(_picture(("truth", "disparity"), "True disparity"))
    if contents.estimate:
        maps.append(estimate)
    if contents.estimate and contents.truth:
        maps.append(_picture(("estimate", "error"), "Error, px of the pair"))
    tabs: list[rrb.Container | rrb.View] = []
    if contents.slices:
        tabs.append(rrb.Vertical(contents=[_picture(path, path[-1].capitalize()) for path in contents.slices]))
        tabs[-1].name = "Epipolar slices"
    if contents.volumes:
        tabs.append(rrb.Tabs(contents=[_volume(*volume) for volume in contents.volumes], name="Volumes"))
    if contents.regions:
        regions = [_overlay(path, contents.reference) for path in contents.regions]
        tabs.append(rrb.Grid(contents=regions, name="Regions"))
    tabs.append(rrb.Grid(contents=[_picture(path, f"View {path[-1]}") for path in contents.views], name="Views"))
    tabs.append(rrb.TextDocumentView(origin="/about", name="About"))
    return rrb.Vertical(
        rrb.Grid(contents=maps, grid_columns=2), rrb.Tabs(contents=tabs, active_tab=0), row_shares=[5, 4]
    )


def _picture(path: EntityPath, name: str) -> rrb.View:
    return rrb.Spatial2DView(origin=rr.new_entity_path(list(path)), name=name)


def _overlay(path: EntityPath, under: EntityPath) -> rrb.View:
    """A region's mask over the reference view."""
    both = [rr.new_entity_path(list(under)), rr.new_entity_path(list(path))]
    return rrb.Spatial2DView(origin="/", contents=both, name=path[-1])


def _space(origin: str, name: str, eye: Eye | None) -> rrb.View:
    """A 3D panel, y down; with no eye the viewer chooses one."""
    controls = eye and rrb.EyeControls3D(position=eye[0], look_target=eye[1], eye_up=(0.0, -1.0, 0.0))
    return rrb.Spatial3DView(
        origin=f"/{origin}",
        name=name,
        eye_controls=controls,
        line_grid=rrb.LineGrid3D(visible=False),
        background=(24, 26, 30),
    )


def _volume(path: EntityPath, row: int) -> rrb.View:
    """A slice of a volume with a slider over its rows, the farthest plane at the bottom."""
    selection = rrb.TensorSliceSelection(
        width=rr.TensorDimensionSelection(dimension=2),
        height=rr.TensorDimensionSelection(dimension=1, invert=True),
        indices=[rr.TensorDimensionIndexSelection(dimension=0, index=row)],
    )
    grey = rrb.TensorScalarMapping(colormap="grayscale", mag_filter="nearest")
    origin, name = rr.new_entity_path(list(path)), " ".join(path[1:])
    return rrb.TensorView(
        origin=origin, name=name, slice_selection=selection, scalar_mapping=grey, view_fit="fillkeepaspectratio"
    )
