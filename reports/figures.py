"""Pictures for the page: encoded maps, colour bars, accuracy against seconds."""

import io
import re
from base64 import b64encode
from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from matbench.coloring import palette
from matbench.reports.tables import label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIDE = 512  # px; larger pictures are made smaller
LEVELS = 128  # steps of a colour scale: no eye sees them, and files are a quarter smaller
INK = "#01fe02"  # stands for the page's text colour until the SVG is written


def _smaller(picture: NDArray[np.uint8], exact: bool) -> NDArray[np.uint8]:
    rows, columns = picture.shape[:2]
    shrink = SIDE / max(rows, columns)
    if shrink >= 1:
        return picture
    size = max(1, round(columns * shrink)), max(1, round(rows * shrink))
    made = cv2.resize(picture, size, interpolation=cv2.INTER_NEAREST if exact else cv2.INTER_AREA)
    return made.astype(np.uint8, copy=False)


def data_uri(picture: NDArray[np.uint8], exact: bool = True) -> str:
    """(H, W, 3) RGB -> a WebP as ``data:`` address: lossless if `exact`, else as a photograph."""
    quality = 101 if exact else 88
    bgr = np.ascontiguousarray(_smaller(picture, exact)[..., ::-1])
    done, encoded = cv2.imencode(".webp", bgr, [cv2.IMWRITE_WEBP_QUALITY, quality])
    if not done:
        raise RuntimeError(f"OpenCV could not encode a picture of {bgr.shape[1]}x{bgr.shape[0]} px")
    return "data:image/webp;base64," + b64encode(encoded.tobytes()).decode("ascii")


def gradient(name: str, stops: int = 17) -> str:
    """A colour map as stops of a CSS gradient."""
    return ", ".join("#{:02x}{:02x}{:02x}".format(*map(int, c)) for c in palette(name, stops))


def printable(name: str, longest: int = 44) -> str:
    """A name of at most `longest` characters, none of which do anything."""
    name = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in name)
    return name if len(name) <= longest else name[: longest // 2] + "…" + name[1 - longest // 2 :]


def _place_labels(figure: "Figure", axes: "Axes", points: Sequence[tuple[float, float, str]]) -> None:
    """Write each name beside its point, where it covers no other name and no point."""
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
    """The points that no other beats in both numbers, from left to right."""
    best, kept = float("inf"), []
    for point in sorted(points):
        if point[1] < best:
            best = point[1]
            kept.append(point)
    return kept


def cost(rows: pd.DataFrame, score: str, unit: str) -> "Figure | None":
    """Accuracy against seconds: a point per ranked method of `tables.summary`, or None without any.

    Parameters
    ----------
    rows
        The summary.
    score
        Its column for the vertical axis; less is better.
    unit
        Of that column.
    """
    ranked = rows[rows["ranked"]].dropna(subset=[score, "seconds"])
    points = [(max(float(r["seconds"]), 1e-4), float(r[score]), printable(str(m))) for m, r in ranked.iterrows()]
    if not points:
        return None
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, NullFormatter

    figure = Figure(figsize=(7.2, 3.9), layout="constrained")
    axes = figure.subplots()
    along = front(points)
    axes.step([p[0] for p in along], [p[1] for p in along], where="post", color=INK, lw=1, ls=(0, (3, 3)), alpha=0.6)
    axes.scatter([p[0] for p in points], [p[1] for p in points], s=52, color="#3b78c3", edgecolor=INK, lw=0.8, zorder=3)
    axes.set_xscale("log")
    xs = [p[0] for p in points]
    axes.set_xlim(min(xs) / 1.8, max(xs) * 1.8)
    axes.set_ylim(0, max(p[1] for p in points) * 1.18 or 1)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    minor = FuncFormatter(lambda value, _: f"{value:g}") if max(xs) < 10 * min(xs) else NullFormatter()
    axes.xaxis.set_minor_formatter(minor)
    axes.set_xlabel("seconds per scene (logarithmic)", color=INK)
    axes.set_ylabel(f"{score}, {unit}", color=INK)
    axes.tick_params(which="both", colors=INK)
    axes.grid(True, alpha=0.25, lw=0.6, color=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(INK)
    _place_labels(figure, axes, points)
    return figure


def reliability(curves: pd.DataFrame | None) -> "Figure | None":
    """Observed share of surface against materiality: a line for each method, its bins pooled over all scenes.

    Parameters
    ----------
    curves
        As `matbench.scoring.reliabilities` gives them; None or empty gives no figure.
    """
    if curves is None or curves.empty:
        return None
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.6, 3.9), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=INK, lw=1, ls=(0, (3, 3)), alpha=0.6)
    for number, ((algorithm, params), rows) in enumerate(curves.groupby(["algorithm", "params"], sort=False)):
        points = rows["points"].to_numpy(float)
        place = np.minimum((rows["materiality"] * 10).astype(int), 9)
        sums = pd.DataFrame({name: rows[name] * points for name in ("materiality", "observed")}).assign(points=points)
        pooled = sums.groupby(place).sum()
        x, y = (pooled[name] / pooled["points"] for name in ("materiality", "observed"))
        name = printable(label(str(algorithm), str(params)))
        axes.plot(x, y, marker="osD^v"[number % 5], ms=5, lw=1.4, color=f"C{number}", label=name)
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
    axes.set_xlabel("materiality", color=INK)
    axes.set_ylabel("share of points with a surface", color=INK)
    axes.tick_params(which="both", colors=INK)
    axes.grid(True, alpha=0.25, lw=0.6, color=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(INK)
    for text in axes.legend(frameon=False, labelcolor=INK, loc="upper left").get_texts():
        text.set_parse_math(False)
    return figure


def svg(figure: "Figure") -> str:
    """A figure as an ``<svg>`` element to stand in a page: no address in it, in the page's colour and font."""
    from matplotlib import rc_context

    out = io.StringIO()
    metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "matbench"}):
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
