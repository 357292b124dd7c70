"""The critical-difference diagram: mean ranks on a line, with bars under methods that chance may have ordered."""

from typing import TYPE_CHECKING, Any

from matbench.reports.page_figures import shortened
from matbench.reports.paper_figure import INCHES, CaptionedFigure, Width, small_print
from matbench.reports.standing import Ranking

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RANK = 9  # characters that a rank and the blanks beside it take


def figure(ranking: Ranking, ink: str = "black", size: float = 8, width: float = 7.2) -> "Figure":
    """The diagram of Demsar 2006, figure 1: best on the left.

    Parameters
    ----------
    ranking
        At least two methods.
    ink
        Colour of everything.
    size
        Of the letters, in points.
    width
        Inches.
    """
    from matplotlib.figure import Figure

    letter, line = 0.6 * size / 72, 1.55 * size / 72  # inches
    most = int(0.4 * width / letter) - _RANK
    names = {name: shortened(name, most) for name in ranking.means}
    count = len(names)
    left = (count + 1) // 2  # so many methods are named on the left
    bars = ranking.alike
    below = 0.14 * (len(bars) + 1) + line * left
    drawn = Figure(figsize=(width, below + 0.75))
    axes = drawn.add_axes((0.02, 0, 0.96, 1))
    axes.set_axis_off()
    room = 1 - 2 * (max(map(len, names.values())) + _RANK) * letter / (0.96 * width)

    def across(rank: float) -> float:
        return 0.5 + room * ((rank - 1) / (count - 1) - 0.5)

    height, top = below + 0.75, below + 0.1
    axes.set_xlim(0, 1)
    axes.set_ylim(0, height)
    stroke: dict[str, Any] = {"color": ink, "lw": 0.8, "solid_capstyle": "butt"}
    axes.plot([across(1), across(count)], [top, top], **stroke)
    for rank in range(1, count + 1):
        axes.plot([across(rank)] * 2, [top, top + 0.05], **stroke)
        axes.text(across(rank), top + 0.08, str(rank), ha="center", va="bottom", fontsize=size, color=ink)
    reach = min(ranking.critical, count - 1)
    level = top + 0.36
    axes.plot([across(1), across(1 + reach)], [level, level], **stroke)
    for end in (1.0, 1 + reach):
        axes.plot([across(end)] * 2, [level - 0.04, level + 0.04], **stroke)
    said = f"critical difference {ranking.critical:.2f}"
    axes.text(across(1), level + 0.07, said, ha="left", va="bottom", fontsize=size, color=ink)
    for number, group in enumerate(bars):
        ends = [across(ranking.means[name]) for name in (group[0], group[-1])]
        at = top - 0.14 * (number + 1)
        axes.plot([ends[0] - 0.006, ends[1] + 0.006], [at, at], color=ink, lw=3, solid_capstyle="butt")
    for number, (name, mean) in enumerate(ranking.means.items()):
        is_left = number < left
        at = top - 0.14 * (len(bars) + 0.5) - line * ((number if is_left else count - 1 - number) + 0.5)
        end = 0.5 - room / 2 - 0.01 if is_left else 0.5 + room / 2 + 0.01
        axes.plot([across(mean), across(mean), end], [top, at, at], **stroke | {"lw": 0.6})
        said = f"{names[name]}  {mean:.2f}" if is_left else f"{mean:.2f}  {names[name]}"
        side = "right" if is_left else "left"
        axes.text(end, at, f" {said} ", ha=side, va="center", fontsize=size, color=ink, parse_math=False)
    return drawn


def caption(ranking: Ranking, metric: str, region: str) -> str:
    """What the diagram shows, and the tests behind it."""
    p = "< 0.001" if ranking.p < 0.001 else f"= {ranking.p:.3f}"
    return (
        f"Mean ranks by {metric} in {region} over {ranking.scenes} scenes; 1 is best. Methods on one bar are closer "
        f"than the critical difference of {ranking.critical:.2f} (Nemenyi, 95 %): chance may have ordered them. "
        f"Friedman's test that all are equal: p {p}."
    )


def draw(ranking: Ranking, metric: str, region: str, width: Width = "column") -> CaptionedFigure:
    """The diagram for a paper."""
    with small_print():
        return CaptionedFigure(figure(ranking, size=6.5, width=INCHES[width]), caption(ranking, metric, region))
