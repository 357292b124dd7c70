"""The energies that methods told of every pass."""

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from matbench.reports import page_figures
from matbench.reports.content import Report
from matbench.reports.tables import Shared, label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOTAL = "total"
_LARGEST = 1e30  # per cent of the first pass; a stored history may hold any number


def _told(report: Report, scope: Shared) -> dict[str, dict[str, list[NDArray[np.float64]]]]:
    """Method -> name -> the numbers of each pass, for every cell that told at least two."""
    found: dict[str, dict[str, list[NDArray[np.float64]]]] = {}
    for (algorithm, params, _, _), history in report.histories.items():
        for name, numbers in history.items():
            values = np.array([np.nan if n is None else n for n in numbers], np.float64)
            if np.isfinite(values).sum() > 1 and np.nanmax(np.abs(values)) > 0:  # a term that is off tells nothing
                found.setdefault(label(algorithm, params), {}).setdefault(name, []).append(values)
    return {method: found[method] for method in scope.methods if method in found}


def _per_cent(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Numbers in per cent of the first, which is positive; NaN for what no axis can show."""
    with np.errstate(over="ignore"):
        found = 100 * (values / values[0])
    return np.where(np.abs(found) < _LARGEST, found, np.nan)


def energies(report: Report, scope: Shared) -> "Figure | None":
    """A panel for each method with an energy: the total in per cent of the first pass, a line for each cell."""
    told = {m: names[TOTAL] for m, names in _told(report, scope).items() if TOTAL in names}
    drawn = {m: [_per_cent(cell) for cell in cells if cell[0] > 0] for m, cells in told.items()}
    drawn = {m: cells for m, cells in drawn.items() if cells}
    if not drawn:
        return None
    figure, grid = page_figures.grid_of(len(drawn))
    for place, (axes, (method, cells)) in enumerate(zip(grid, drawn.items(), strict=True)):
        for values in cells:
            axes.plot(np.arange(1, len(values) + 1), values, color="#0072b2", lw=1, alpha=0.5)
        longest = max(map(len, cells))
        padded = pd.DataFrame(cells, columns=range(1, longest + 1))
        axes.plot(padded.columns, padded.median(), color=page_figures.INK, lw=2)
        axes.set_ylim(bottom=0, top=max(105.0, float(np.nanmax(padded.to_numpy())) * 1.05))
        axes.set_title(
            page_figures.shortened(method, 36), loc="left", fontsize=9, color=page_figures.INK, parse_math=False
        )
        page_figures.dress(axes)
        axes.set_xlabel("pass", color=page_figures.INK)
        if place % page_figures.ACROSS == 0:
            axes.set_ylabel("energy, % of the first pass", color=page_figures.INK)
    return figure


def lines(report: Report, scope: Shared) -> list[list[str]]:
    """The table as texts: method, name, cells, passes, and the change from the first pass to the last."""
    out = []
    for method, names in _told(report, scope).items():
        for name, cells in names.items():
            passes = sorted({len(values) for values in cells})
            known = [values[np.isfinite(values)] for values in cells]
            change = [_per_cent(v)[-1] - 100 for v in known if v[0] > 0]
            middle = np.median(change) if change else np.nan
            shown = f"{middle:+.1f}" if abs(middle) < 1e6 else f"{middle:+.1e}" if np.isfinite(middle) else "–"
            said = f"{passes[0]}" if len(passes) == 1 else f"{passes[0]} to {passes[-1]}"
            out.append([method, name, str(len(cells)), said, shown])
    return out
