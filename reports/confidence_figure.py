"""What confidence is worth: errors among the pixels of which a method is surest, against how many these are."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import pandas as pd

from matbench.measures.confidence import RISK
from matbench.reports.page_figures import line_style, shortened
from matbench.reports.paper_figure import INCHES, CaptionedFigure, Width, small_print
from matbench.reports.tables import REGION, Shared, labelled, means, metrics, text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = f"bad_{RISK:g}", f"aurc_{RISK:g}", f"ause_{RISK:g}", "ause"
"""The metrics of the table beside the figure."""


def comparable(points: pd.DataFrame, scope: Shared) -> pd.DataFrame:
    """The points on the scenes that count for their method, as in the table: `Shared.counted`."""
    told = labelled(points)
    counted = {method: frozenset(scope.counted(method)) for method in scope.methods}
    kept = [s in counted.get(m, ()) for m, s in zip(told["method"], told["scene"], strict=True)]
    return told[kept]


def curves(points: pd.DataFrame, methods: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Method -> its curve, the mean over scenes and seeds.

    Parameters
    ----------
    points
        As in `matbench.results.scores.Tables`.
    methods
        Those to show, in their order; methods without confidence are left out.

    Returns
    -------
    Tables with the columns ``coverage``, ``risk`` and ``best``, in per cent, ordered by coverage.
    """
    told = labelled(points)
    # first over seeds, then over scenes: each scene counts once
    by_scene = told.groupby(["method", "scene", "coverage"], sort=False)[["risk", "best"]].mean()
    mean = by_scene.groupby(level=["method", "coverage"]).mean().reset_index("coverage")
    return {name: mean.loc[[name]].sort_values("coverage") for name in methods if name in mean.index}


def figure(found: dict[str, pd.DataFrame], ink: str = "black", size: float = 8, width: float = 7.2) -> "Figure | None":
    """A line for each method, and a thin dashed one for the lowest risks that its pixels allow; None without methods.

    Parameters
    ----------
    ink
        Colour of letters and axes.
    size
        Of the letters, in points.
    width
        Inches.
    """
    if not found:
        return None
    from matplotlib.figure import Figure

    across = 2 if width > 5 else 1
    most = int(width * 72 / size / across)
    rows = -(-len(found) // across)
    drawn = Figure(figsize=(width, 0.5 * width + (2.2 * rows + 3) * size / 72), layout="constrained")
    axes = drawn.subplots()
    for number, (name, curve) in enumerate(found.items()):
        style = line_style(number) | {"mec": ink, "ms": size / 2, "lw": size / 6}
        axes.plot(curve["coverage"], curve["best"], color=style["color"], lw=0.8, ls=(0, (2, 2)))
        axes.plot(curve["coverage"], curve["risk"], markevery=4, label=shortened(name, most), **style)
    axes.set_xlim(0, 101)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("surest pixels, % of those answered", color=ink, fontsize=size)
    axes.set_ylabel(f"bad_{RISK:g} among them, %", color=ink, fontsize=size)
    axes.tick_params(colors=ink, labelsize=size)
    axes.grid(True, alpha=0.25, lw=0.6, color=ink)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(ink)
    legend = drawn.legend(loc="outside lower left", ncols=across, frameon=False, fontsize=size, labelcolor=ink)
    for entry in legend.get_texts():
        entry.set_parse_math(False)
    return drawn


def lines(results: pd.DataFrame, scope: Shared) -> list[tuple[str, ...]]:
    """The table beside the figure: each method with confidence, and its means by `COLUMNS` in region all, as text."""
    units = metrics(results)
    columns = [name for name in COLUMNS if name in units]
    if COLUMNS[-1] not in columns:
        return []
    scores = pd.DataFrame({name: means(results, scope, REGION, name) for name in columns})
    kept = scores[scores[COLUMNS[-1]].notna()].sort_values(COLUMNS[-1], kind="stable")
    return [(str(method), *(text(row[name], units[name]) for name in columns)) for method, row in kept.iterrows()]


def scenes_of(points: pd.DataFrame, methods: Collection[str]) -> tuple[int, int]:
    """Over how many scenes the curves of these methods are: the least and the most."""
    told = labelled(points)
    each = told[told["method"].isin(methods)].groupby("method")["scene"].nunique()
    return int(each.min()), int(each.max())


def caption(least: int, most: int) -> str:
    """What the figure shows; `least` and `most` as `scenes_of` finds them."""
    scenes = str(most) if least == most else f"{least} to {most}"
    return (
        f"Errors above {RISK:g} px among the pixels of which a method is surest, against how many these are; mean over "
        f"{scenes} {'scene' if most == 1 else 'scenes'}, answered pixels with known truth. Dashed: the lowest that "
        "an order of its pixels can reach. A method whose confidence says nothing has a level line."
    )


def draw(found: dict[str, pd.DataFrame], scenes: tuple[int, int], width: Width = "column") -> CaptionedFigure:
    """The figure for a paper; there must be a curve. `scenes` as `scenes_of` finds them."""
    with small_print():
        drawn = figure(found, size=6.5, width=INCHES[width])
        assert drawn is not None, "the caller has looked"  # noqa: S101
        return CaptionedFigure(drawn, caption(*scenes))
