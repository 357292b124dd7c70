"""How time grows, as tables and as a log-log figure with the counted work beside the measured time."""

from pathlib import Path

import numpy as np
import pandas as pd

from matbench import drawing
from matbench.bench.growth import AXES, PEER, Growth
from matbench.bench.tables import Table, seconds
from matbench.files.csv_tables import csv_text

# Okabe & Ito 2008: told apart by all kinds of eyes
_COLOURS = ("#0072b2", "#56b4e9", "#009e73", "#cc79a7", "#e69f00", "#d55e00", "#000000")
_POINTS = "osD^vPX"
_UNITS = {
    "point_updates": "point, pass",
    "pair_similarities": "point, pair",
    "ssd_evaluations": "window",
    "voxels_tested": "voxel",
    "pixel_disparities": "pixel, disparity",
}
_WORDS = {"pixels": "pixels of a view", "disparities": "disparities", "views": "views"}


def exponents(growth: Growth) -> Table:
    """The table of fitted exponents; in brackets those of the counted work, which are the ideal."""
    rows = []
    for method in growth.methods:
        cells = [method]
        for axis in AXES:
            fit = next((f for f in growth.fits if f.method == method and f.axis == axis), None)
            cells.append(
                "" if fit is None else f"{fit.exponent:.2f} +- {fit.high - fit.exponent:.2f} ({fit.ideal:.2f})"
            )
        rows.append(tuple(cells))
    heads = "method", *(f"over {axis}" for axis in AXES)
    return Table("Exponents of time, 95 % interval (of counted work: the ideal)", heads, tuple(rows))


def costs(growth: Growth) -> Table:
    """The table of nanoseconds per unit of work on the largest images, and what the machine could do in that time."""
    rows = []
    sizes = AXES["pixels"]
    largest = next((s for s in reversed(sizes) if all(growth.at(m, s) for m in growth.methods)), sizes[0])
    for method in growth.methods:
        point = growth.at(method, largest)
        if point is None:
            continue
        name, count = point.counter
        per_cell, per_unit = 1e9 * point.seconds / point.cells, 1e9 * point.seconds / count
        rows.append(
            (
                f"{method}{' (peer)' if method == PEER else ''}",
                seconds(point.seconds),
                f"{per_cell:.3g}",
                f"{per_unit:.3g}",
                _UNITS.get(name, name),
                f"{per_unit * growth.roofline.arithmetic:.0f}",
                f"{per_unit * growth.roofline.bandwidth:.0f}",
            )
        )
    title = f"Cost at {largest[0]}x{largest[1]}, {largest[2]} disparities, {largest[3]} views, one thread"
    heads = "method", "CPU time", "ns / pixel disparity pair", "ns / unit", "unit", "flops", "bytes"
    return Table(title, heads, tuple(rows))


def machine(growth: Growth) -> str:
    """The limits of the machine, measured together with the times, in words."""
    roofline = growth.roofline
    return (
        f"in the same sitting, one thread: memory {roofline.bandwidth:.1f} GB/s (STREAM triad), arithmetic "
        f"{roofline.arithmetic:.0f} GFLOP/s (float32 multiply-adds); flops, bytes: as many fit into a unit's time"
    )


def write_growth(growth: Growth, folder: Path) -> list[Path]:
    """Write ``growth.csv``, ``growth.png`` and ``growth.pdf`` into a folder; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / "growth.csv"
    heads = ["method", "width", "height", "disparities", "views", "seconds", "solves", "counter", "count"]
    rows = [(p.method, *p.setting, f"{p.seconds:.6g}", p.solves, *p.counter) for p in growth.points]
    table.write_text(csv_text(pd.DataFrame(rows, columns=heads)), encoding="utf-8")
    return [table, *_draw(growth, folder)]


@drawing.style()
def _draw(growth: Growth, folder: Path) -> list[Path]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.4), layout="constrained")
    panels = figure.subplots(1, len(AXES), sharey=True)
    for panel, axis in zip(panels, AXES, strict=True):
        for number, method in enumerate(growth.methods):
            curve = growth.of(method, axis)
            if len(curve) < 2:
                continue
            at = np.array([point.along(axis) for point in curve])
            work = np.array([float(point.counter[1]) for point in curve])
            taken = np.array([point.seconds for point in curve])
            colour = _COLOURS[number % len(_COLOURS)]
            panel.loglog(at, taken, marker=_POINTS[number % len(_POINTS)], ms=5, lw=1.4, color=colour, label=method)
            panel.loglog(at, taken[-1] * work / work[-1], ls=(0, (2, 2)), lw=0.9, color=colour)
        panel.set_xlabel(_WORDS[axis])
        ticks = sorted({int(point.along(axis)) for m in growth.methods for point in growth.of(m, axis)})
        panel.set_xticks(ticks, [f"{tick:,}" for tick in ticks], rotation=30 if axis == "pixels" else 0)
        panel.minorticks_off()
        panel.grid(alpha=0.25)
    panels[0].set_ylabel("processor time of a solve (s), one thread")
    panels[0].plot([], [], color="0.4", ls=(0, (2, 2)), lw=0.9, label="as the counted work grows")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    paths = [folder / "growth.png", folder / "growth.pdf"]
    for path in paths:
        figure.savefig(path, dpi=150)
    return paths
