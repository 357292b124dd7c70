"""A figure like the paper's figure 2: one epipolar plane as a method sees it."""

from typing import TYPE_CHECKING, Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithm import Estimate
from matbench.recording import coloring, reduction
from matbench.recording.probe import CapturingProbe
from matbench.reports.paper_figure import INCHES, CaptionedFigure, Width, letter, small_print
from matbench.scene import Scene
from matbench.space import DisparitySpace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINE = "#ffdd00"
SLICE_HEIGHT = 0.55  # inches, in a column


@frozen(eq=False)
class FigureSlice:
    """One slice of the figure, such as materiality.

    Parameters
    ----------
    name
        The title.
    picture
        (planes, columns, 3) uint8, far to near.
    meaning
        What its colours mean, for the caption.
    """

    name: str
    picture: NDArray[np.uint8]
    meaning: str


@frozen(eq=False)
class EpipolarPlane:
    """All slices of one image row.

    Parameters
    ----------
    space
        The disparity space whose planes and columns the slices have.
    views
        Which of the scene's views that space spans, evenly spaced.
    passes
        How many passes the method told of.
    """

    row: int
    space: DisparitySpace
    views: tuple[int, ...]
    slices: tuple[FigureSlice, ...]
    passes: int

    @property
    def step(self) -> int:
        """View steps of the scene between neighbouring views of the space."""
        return self.views[1] - self.views[0]


def epipolar_plane(scene: Scene, probe: CapturingProbe, estimate: Estimate) -> EpipolarPlane | None:
    """The slices of the first wanted row, from the method's last pass and its answer; None if there are none."""
    (row, *_), labels = probe.wanted.rows, scene.labels
    found: list[FigureSlice] = []
    similarity, volume = probe.similarity(labels), estimate.volume
    if similarity is not None:
        found.append(
            FigureSlice("similarity", similarity.picture[0], f"similarity of the pairs {_named(similarity.names)}")
        )
    if volume is not None:
        seen = probe.visibility(volume, labels)
        found.append(FigureSlice("visibility", seen.picture[0], f"visibility in the views {_named(seen.names)}"))
        grey = reduction.as_bytes(probe.slices_of(volume).values[0])
        found.append(FigureSlice("materiality", np.repeat(grey[:, :, None], 3, axis=2), "materiality, white is high"))
    slopes = next((f.derivative for f in reversed(probe.frames) if f.derivative is not None), None)
    if slopes is not None:
        meaning = "energy derivative according to materiality: red negative, blue positive, black zero"
        found.append(FigureSlice("energy derivative", reduction.sign_colors(slopes[0]), meaning))
    where = volume or probe.latest
    if not found or where is None:
        return None
    space = where.space
    same_size = tuple(s for s in found if s.picture.shape[:2] == space.shape[1:])
    told = max((len(values) for values in probe.energies.values()), default=0)
    return EpipolarPlane(row, space, where.views, same_size, told)


def _named(names: tuple[str, ...]) -> str:
    colored = [f"{name} ({color})" for name, color in zip(names, ("red", "green", "blue"), strict=False)]
    return ", ".join(colored)


def draw(scene: Scene, plane: EpipolarPlane, method: str, width: Width = "column") -> CaptionedFigure:
    """Draw reference view, truth, and below them the slices of one row.

    Parameters
    ----------
    method
        The method's name with its changed parameters, for the caption.
    """
    inches, count = INCHES[width], len(plane.slices)
    truth = scene.truth.get(scene.ref)
    top = inches * (0.46 if truth is not None else 0.6) * scene.height / scene.width + 0.2
    each = SLICE_HEIGHT * (inches / INCHES["column"]) ** 0.5
    with small_print():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(inches, top + count * (each + 0.14) + 0.3))
        figure.set_layout_engine("constrained", w_pad=0.02, h_pad=0.04, wspace=0.02, hspace=0.02)
        upper, lower = figure.subfigures(2, 1, height_ratios=[top, count * (each + 0.14) + 0.3], squeeze=False)[:, 0]
        panels = _top(upper, scene, plane.row, truth)
        axes = lower.subplots(count, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        for number, (axis, one) in enumerate(zip(axes, plane.slices, strict=True), len(panels)):
            _draw_slice(axis, plane, one, f"({letter(number)}) {one.name}")
        axes[-1].set_xlabel(f"column of view {scene.labels[plane.views[0]]} [px]")
        lower.supylabel("disparity [px per view step]" if count > 2 else "disparity", fontsize="medium")
    panels += [one.meaning for one in plane.slices]
    letters = "; ".join(f"({letter(i)}) {panel}" for i, panel in enumerate(panels))
    first, last = (float(d) / plane.step for d in plane.space.disparities[[0, -1]])
    passes = f" after {plane.passes} pass{'es' if plane.passes != 1 else ''}" if plane.passes else ""
    caption = (
        f"Slice through the disparity space of {scene.name}, epipolar plane of row {plane.row}, by {method}{passes}. "
        f"{letters}. Disparities {first:.4g} to {last:.4g} px per view step, the nearest on top; columns in px of "
        f"view {scene.labels[plane.views[0]]}, beyond its frame too."
    )
    return CaptionedFigure(figure, caption)


def _top(figure: Any, scene: Scene, row: int, truth: NDArray[np.float32] | None) -> list[str]:
    """Draw the reference view and its truth with the row marked; what the caption says of them."""
    pictures = [("reference view", scene.views[scene.ref], f"reference view {scene.labels[scene.ref]}")]
    if truth is not None:
        low, high = coloring.disparity_ends(scene)
        meaning = f"true disparity, {low:.4g} (dark) to {high:.4g} (yellow) px per view step, grey unknown"
        pictures.append(("true disparity", coloring.truth_colors(truth, (low, high)), meaning))
    axes = figure.subplots(1, len(pictures), squeeze=False)[0]
    for number, (axis, (title, picture, _)) in enumerate(zip(axes, pictures, strict=True)):
        axis.imshow(picture)
        axis.axhline(row, color="black", lw=1.4)
        axis.axhline(row, color=LINE, lw=0.8)
        axis.set_title(f"({letter(number)}) {title}")
        axis.axis("off")
    return [pictures[0][2] + f", row {row} in yellow", *(meaning for _, _, meaning in pictures[1:])]


def _draw_slice(axis: "Axes", plane: EpipolarPlane, one: FigureSlice, title: str) -> None:
    space, half = plane.space, 0.5 / plane.space.fineness
    left = space.origin / space.fineness
    low, high = (float(d) / plane.step for d in space.disparities[[0, -1]])
    thick = half / plane.step
    extent = (left - half, left + (space.columns - 1) / space.fineness + half, low - thick, high + thick)
    axis.imshow(one.picture[::-1], extent=extent, aspect="auto")
    axis.set_title(title, loc="left")
