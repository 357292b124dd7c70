"""Figures of the report page: accuracy against cost, curves in panels, reliability; all become SVG."""

import io
import re
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from matbench import drawing
from matbench.recording.coloring import palette
from matbench.reports.tables import label
from matbench.safe_text import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#01fe02"  # stands for the page's text colour until the SVG is written
ACROSS = 3  # panels side by side

# Okabe & Ito 2008: told apart by all kinds of eyes; the shapes of points tell them apart without colour
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_POINTS = ("o", "s", "^", "D", "v", "P", "X")
_LINES = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))


def page_look() -> AbstractContextManager[None]:
    """A context in which the page's figures are drawn and saved."""
    return drawing.style({"svg.fonttype": "none", "svg.hashsalt": "matbench"})


def gradient(name: str, stops: int = 17) -> str:
    """A colour map as the stops of a CSS gradient."""
    return ", ".join("#{:02x}{:02x}{:02x}".format(*map(int, c)) for c in palette(name, stops))


def shortened(name: str, longest: int = 44) -> str:
    """A name shortened to `longest` characters, hidden ones as escapes."""
    name = printable(name)
    return name if len(name) <= longest else name[: longest // 2] + "…" + name[1 - longest // 2 :]


def line_style(index: int) -> dict[str, Any]:
    """Colour, marker and line style of the method with that number, the same in every figure."""
    return {
        "color": _COLOURS[index % len(_COLOURS)],
        "marker": _POINTS[index % len(_POINTS)],
        "ls": _LINES[index // len(_COLOURS) % len(_LINES)],
        "ms": 4.5,
        "lw": 1.6,
        "mec": INK,
        "mew": 0.5,
    }


def dress(axes: "Axes", size: float = 8) -> None:
    """Give axes the page's colour and a light grid."""
    axes.tick_params(which="both", colors=INK, labelsize=size)
    for along in (axes.xaxis, axes.yaxis):
        along.label.set_fontsize(size + 1)
    axes.grid(True, alpha=0.25, lw=0.6, color=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(INK)


def grid_of(count: int) -> "tuple[Figure, list[Axes]]":
    """A figure with `count` panels, `ACROSS` side by side, and their axes."""
    from matplotlib.figure import Figure

    across = min(ACROSS, count)
    down = -(-count // across)
    figure = Figure(figsize=(7.2, 0.5 + 1.95 * down), layout="constrained")
    axes = list(figure.subplots(down, across, squeeze=False).flat)
    for unused in axes[count:]:
        unused.set_axis_off()
    return figure, axes[:count]


def name_curves(figure: "Figure", methods: Sequence[str]) -> None:
    """Write a legend with the methods' names below all panels."""
    from matplotlib.lines import Line2D

    names = [shortened(method) for method in methods]
    longest = max(map(len, names), default=0)
    columns = max(1, min(4, len(names), 100 // (longest + 8)))
    handles = [Line2D([], [], **line_style(i)) for i in range(len(names))]
    legend = figure.legend(
        handles, names, loc="outside lower left", ncols=columns, frameon=False, fontsize=8, labelcolor=INK
    )
    for text in legend.get_texts():
        text.set_parse_math(False)
    # room for its lines, which the panels would else give up
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + 0.2 * -(-len(names) // columns))


Curve = tuple[NDArray[np.float64], NDArray[np.float64]]


def panels(
    parts: Sequence[tuple[str, Mapping[str, Curve]]], across: str, up: str, every: int = 1, backwards: bool = False
) -> "Figure | None":
    """A panel for each part (title, method -> (x, y)); None if there is no curve.

    Parameters
    ----------
    across, up
        Names of the axes.
    every
        Every how many points a marker is drawn.
    backwards
        Whole numbers along x, the largest first.
    """
    parts = [(title, curves) for title, curves in parts if curves]
    if not parts:
        return None
    methods = list(dict.fromkeys(method for _, curves in parts for method in curves))
    figure, grid = grid_of(len(parts))
    for place, (axes, (title, curves)) in enumerate(zip(grid, parts, strict=True)):
        for index, method in enumerate(methods):
            if method in curves:
                axes.plot(*curves[method], markevery=every, **line_style(index))
        dress(axes)
        axes.set_title(title, loc="left", fontsize=9, color=INK, parse_math=False)
        axes.set_ylim(bottom=0)
        if backwards:
            axes.set_xticks(sorted({x for xs, _ in curves.values() for x in xs.tolist()}))
            axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
            axes.invert_xaxis()
        else:
            axes.set_xlim(left=0)
        if place % ACROSS == 0:
            axes.set_ylabel(up, color=INK)
        if place + ACROSS >= len(parts):
            axes.set_xlabel(across, color=INK)
    name_curves(figure, methods)
    return figure


def _place_labels(figure: "Figure", axes: "Axes", points: Sequence[tuple[float, float, str]]) -> None:
    """Write each name beside its point, so that it covers no other name and no point."""
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

    figure.draw_without_rendering()
    spots = [axes.transData.transform((x, y)) for x, y, _ in points]
    taken = [Bbox.from_bounds(x - 5, y - 5, 10, 10) for x, y in spots]
    for (x, y, name), spot in zip(points, spots, strict=True):
        left_half = spot[0] < axes.bbox.x0 + axes.bbox.width * 0.55
        sides = ((9, "left"), (-9, "right")) if left_half else ((-9, "right"), (9, "left"))
        choices = [(dx, dy, ha) for dy in (0, 13, -13, 26, -26, 39, -39) for dx, ha in sides]
        leader = {"arrowstyle": "-", "color": INK, "lw": 0.6, "alpha": 0.6, "shrinkA": 0, "shrinkB": 4}
        text = axes.annotate(
            name,
            (x, y),
            (0, 0),
            textcoords="offset points",
            va="center",
            color=INK,
            parse_math=False,
            arrowprops=leader,
        )
        for dx, dy, ha in choices:
            text.set(position=(dx, dy), ha=ha)
            text.get_window_extent()  # moves it; with its leader, so measured again without
            box = Text.get_window_extent(text)
            inside = axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1
            if inside and not any(box.overlaps(other) for other in taken):
                break
        else:
            text.set(position=choices[0][:2], ha=choices[0][2])
            text.get_window_extent()
        taken.append(Text.get_window_extent(text))


def front(points: Sequence[tuple[float, float, str]]) -> list[tuple[float, float, str]]:
    """The Pareto front: the points that no other beats in both numbers, from left to right."""
    best, kept = float("inf"), []
    for point in sorted(points):
        if point[1] < best:
            best = point[1]
            kept.append(point)
    return kept


COSTS = {"seconds": "seconds per scene (logarithmic)", "memory": "peak memory, MiB (logarithmic)"}


def cost(rows: pd.DataFrame, score: str, unit: str, against: str = "seconds") -> "Figure | None":
    """Accuracy against cost, a point for each ranked method; None if there is none.

    Parameters
    ----------
    rows
        The table of `tables.summary`.
    score
        Its column for the vertical axis; less is better.
    unit
        Of that column.
    against
        Its column for the horizontal axis, one of `COSTS`.
    """
    ranked = rows[rows["ranked"]].dropna(subset=[score, against])
    points = [(max(float(r[against]), 1e-4), float(r[score]), shortened(str(m))) for m, r in ranked.iterrows()]
    if not points:
        return None
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    figure = Figure(figsize=(7.2, 3.9), layout="constrained")
    axes = figure.subplots()
    along = front(points)
    look: dict[str, Any] = {"color": INK, "lw": 1, "ls": (0, (3, 3)), "alpha": 0.6}
    axes.step([p[0] for p in along], [p[1] for p in along], where="post", **look)
    axes.scatter([p[0] for p in points], [p[1] for p in points], s=52, color="#3b78c3", edgecolor=INK, lw=0.8, zorder=3)
    axes.set_xscale("log")
    xs = [p[0] for p in points]
    axes.set_xlim(min(xs) / 1.8, max(xs) * 1.8)
    axes.set_ylim(0, max(p[1] for p in points) * 1.18 or 1)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if max(xs) > 100 * min(xs) else (1.0, 2.0, 5.0)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel(COSTS[against], color=INK)
    axes.set_ylabel(f"{score}, {unit}", color=INK)
    dress(axes, size=10)
    _place_labels(figure, axes, points)
    return figure


def reliability(curves: pd.DataFrame | None) -> "Figure | None":
    """Observed share of surface against materiality: a line for each method, its bins pooled over all scenes.

    Parameters
    ----------
    curves
        As `matbench.results.scores.reliabilities` gives them; None or empty gives no figure.
    """
    if curves is None or curves.empty:
        return None
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.9), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=INK, lw=1, ls=(0, (3, 3)), alpha=0.6)
    for number, ((algorithm, params), rows) in enumerate(curves.groupby(["algorithm", "params"], sort=False)):
        points = rows["points"].to_numpy(float)
        place = np.minimum((rows["materiality"] * 10).astype(int), 9)
        sums = pd.DataFrame({name: rows[name] * points for name in ("materiality", "observed")}).assign(points=points)
        pooled = sums.groupby(place).sum()
        x, y = (pooled[name] / pooled["points"] for name in ("materiality", "observed"))
        name = shortened(label(str(algorithm), str(params)))
        axes.plot(x, y, label=name, **line_style(number))
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
    axes.set_xlabel("materiality", color=INK)
    axes.set_ylabel("share of points with a surface", color=INK)
    dress(axes)
    axes.set_anchor("W")
    legend = axes.legend(frameon=False, labelcolor=INK, loc="upper left", bbox_to_anchor=(1.02, 1), fontsize=8)
    for text in legend.get_texts():
        text.set_parse_math(False)
    return figure


def svg(figure: "Figure") -> str:
    """A figure as an ``<svg>`` element for the page: in its colour and font, and without any address."""
    out = io.StringIO()
    metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with page_look():
        figure.savefig(out, format="svg", transparent=True, metadata=metadata)
    text = out.getvalue()
    text = text[text.index("<svg") :].replace(INK, "currentColor")
    for unwanted in (
        r"<metadata>.*?</metadata>",
        r"<style.*?</style>",
        r'\sxmlns(?::\w+)?="[^"]*"',
        r"font-family: [^;\"]*; ",
    ):
        text = re.sub(unwanted, "", text, flags=re.DOTALL)
    used = set(re.findall(r"#([\w.-]+)", text))
    # several figures stand in one page: no name twice
    text = re.sub(r'\sid="([\w.-]+)"', lambda found: found[0] if found[1] in used else "", text)
    return re.sub(r'^<svg [^>]*?viewBox="([^"]*)"[^>]*>', r'<svg viewBox="\1" aria-hidden="true">', text)
