"""A figure like the paper's figure 3: scenes, their true disparities, and the maps of methods."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.errors import UserError, failure
from matbench.measures.metrics import Metric, map_in_region
from matbench.recording import coloring
from matbench.reports.page_figures import shortened
from matbench.reports.paper_figure import INCHES, TALLEST, CaptionedFigure, Width, letter, small_print
from matbench.scene import Scene
from matbench.spec import read_scene

ABREAST: dict[Width, int] = {"column": 4, "page": 8}
"""The most scenes side by side."""
LEAST = 0.45
"""Inches: the least width of a picture in which something can be seen."""


@frozen(eq=False)
class Maps:
    """What the figure shows.

    Parameters
    ----------
    scenes
        One for each column.
    methods
        One for each row, after the reference view and the truth.
    disparity
        (method, scene's name) -> (H, W) map in pixels per view step; missing where there is none.
    """

    scenes: tuple[Scene, ...]
    methods: tuple[str, ...]
    disparity: Mapping[tuple[str, str], NDArray[np.float32]]


def draw(maps: Maps, width: Width = "column", errors: bool = False, metric: Metric | None = None) -> CaptionedFigure:
    """Draw reference views, truths and maps, one scene in each column; with `errors`, also the errors of each map.

    Parameters
    ----------
    metric
        One that has a picture, to be drawn of each map.

    Raises
    ------
    UserError
        If it does not fit on a page.
    """
    inches = INCHES[width]
    lines = [maps.scenes[i : i + ABREAST[width]] for i in range(0, len(maps.scenes), ABREAST[width])]
    pictures = Pictures.of(maps, metric)
    rows, titles = _rows(maps, errors, pictures), _titles(maps.scenes)
    across = max(map(len, lines))
    shapes = [max(s.height / s.width for s in line) for line in lines]
    spare = TALLEST - sum(0.24 + 0.03 * len(rows) for _ in lines)
    side = min((inches - 0.18) / across, inches / 2, spare / (len(rows) * sum(shapes)))
    if side < LEAST:
        raise UserError(
            f"{len(maps.scenes)} scenes with {len(rows)} pictures each are more than a page holds: choose some by -s "
            "and -a, or take --width page"
        )
    heights = [side * shape for shape in shapes]
    tall = sum(len(rows) * (height + 0.03) + 0.24 for height in heights)
    margin = (inches - across * side) / 2 + 0.08
    with small_print():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(inches, tall))
        below = tall
        for line, height in zip(lines, heights, strict=True):
            below -= 0.2
            for at, scene in enumerate(line):
                for number, (kind, method, _) in enumerate(rows):
                    bottom = below - (number + 1) * (height + 0.03)
                    box = (margin + at * side + 0.01, bottom, side - 0.02, height)
                    axis = figure.add_axes((box[0] / inches, box[1] / tall, box[2] / inches, box[3] / tall))
                    _draw(axis, maps, scene, kind, method, pictures)
                name = shortened(titles[scene.name], round(17 * side))
                figure.text(
                    (margin + (at + 0.5) * side) / inches, (below + 0.05) / tall, name, ha="center", parse_math=False
                )
            for number in range(len(rows)):
                middle = below - (number + 0.5) * (height + 0.03)
                figure.text(
                    (margin - 0.08) / inches,
                    middle / tall,
                    f"({letter(number)})",
                    ha="center",
                    va="center",
                    rotation=90,
                )
            below -= len(rows) * (height + 0.03) + 0.04
    return CaptionedFigure(figure, _caption(maps, rows))


@frozen(eq=False)
class Pictures:
    """What a metric shows of each map, all in one scale.

    Parameters
    ----------
    what
        Metric and ends of the scale, in words; empty if there is no metric.
    values
        (method, scene's name) -> (H, W).
    most
        What the last colour stands for.
    """

    what: str = ""
    values: Mapping[tuple[str, str], NDArray[np.floating]] = {}
    most: float = 1.0
    is_signed: bool = False

    @classmethod
    def of(cls, maps: Maps, metric: Metric | None) -> "Pictures":
        """Px of the pair end where those of errors do, other numbers at the largest.

        Raises
        ------
        UserError
            If the metric fails, or gives something that is no picture.
        """
        if metric is None or metric.picture is None:
            return cls()
        values = {}
        for scene in maps.scenes:
            for method in maps.methods:
                found = maps.disparity.get((method, scene.name))
                if found is not None and scene.ref in scene.truth:
                    values[method, scene.name] = _picture(metric, scene, found)
        known = np.concatenate([[0.0], *(array[np.isfinite(array)] for array in values.values())])
        is_signed, unit = bool(known.min() < 0), f" {metric.unit}".rstrip()
        most = coloring.WORST if metric.unit == "px" else float(np.abs(known).max()) or 1.0
        ends = f"{-most:.4g} (brown) over 0 (white) to {most:.4g}{unit} (violet)" if is_signed else ""
        what = f"{metric.name}, {ends or f'0 (black) to {most:.4g}{unit} and more (pale)'}, grey nothing to show"
        return cls(what, values, most, is_signed)


def _picture(metric: Metric, scene: Scene, found: NDArray[np.float32]) -> NDArray[np.floating]:
    assert metric.picture is not None, "the caller has looked"  # noqa: S101
    try:
        values = np.asarray(metric.picture(map_in_region(scene, found, np.ones(found.shape, bool))), np.float64)
    except Exception as error:
        raise UserError(f"picture of metric {metric.name}: {failure(error)}") from error
    if values.shape != found.shape:
        raise UserError(f"picture of metric {metric.name} is {values.shape}, not {found.shape} numbers")
    return values


def _rows(maps: Maps, errors: bool, pictures: Pictures) -> list[tuple[str, str, str]]:
    """Every row as (kind, method, what the caption says)."""
    rows = [("view", "", "reference views")]
    if any(scene.ref in scene.truth for scene in maps.scenes):
        rows.append(("truth", "", "true disparities, grey unknown"))
    for method in maps.methods:
        rows.append(("map", method, method))
        if errors:
            rows.append(
                ("error", method, f"its errors, 0 (black) to {coloring.WORST:g} px of the pair and more (pale)")
            )
        if pictures.what:
            rows.append(("picture", method, pictures.what))
    return rows


def _draw(axis: Any, maps: Maps, scene: Scene, kind: str, method: str, pictures: Pictures) -> None:
    axis.axis("off")
    axis.set_anchor("N")
    truth, ends = scene.truth.get(scene.ref), coloring.disparity_ends(scene)
    if kind == "view":
        axis.imshow(scene.views[scene.ref])
    if kind == "truth" and truth is not None:
        axis.imshow(coloring.truth_colors(truth, ends))
    found = maps.disparity.get((method, scene.name))
    if kind == "map" and found is not None:
        axis.imshow(coloring.disparity_colors(found, ends))
    if kind == "error" and found is not None and truth is not None:
        axis.imshow(coloring.error_colors(found, truth, scene.pair_steps))
    if kind == "picture" and (method, scene.name) in pictures.values:
        values = pictures.values[method, scene.name]
        axis.imshow(coloring.picture_colors(values, pictures.most, pictures.is_signed))
    if not axis.images:
        axis.text(0.5, 0.5, "none", ha="center", va="center", transform=axis.transAxes)


def _titles(scenes: Sequence[Scene]) -> dict[str, str]:
    """Short titles: without dataset and options if they still differ. The caption has the whole names."""
    whole = {scene.name: scene.name for scene in scenes}
    tails = {name: name.partition("/")[2] or name for name in whole}
    bare = {name: read_scene(name).name.partition("/")[2] or name for name in whole}
    return next(short for short in (bare, tails, whole) if len(set(short.values())) == len(whole))


def _caption(maps: Maps, rows: Sequence[tuple[str, str, str]]) -> str:
    letters = "; ".join(f"({letter(i)}) {what}" for i, (_, _, what) in enumerate(rows))
    ends = []
    for scene in maps.scenes:
        low, high = coloring.disparity_ends(scene)
        ends.append(f"{scene.name} (view {scene.labels[scene.ref]}, {low:.4g} to {high:.4g})")
    missing = [f"{m} on {s.name}" for m in maps.methods for s in maps.scenes if (m, s.name) not in maps.disparity]
    lacks = f" Without a map: {', '.join(missing)}." if missing else ""
    return (
        f"Disparity maps. Columns: {', '.join(ends)}, disparities in px per view step from dark blue to yellow, one "
        f"scale for each scene; striped: no answer. Rows: {letters}.{lacks}"
    )
