"""Draw ``docs/images/disparity-space.svg``: pixel rays and target points, seen from above and in disparity space.

python docs/disparity_space.py
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from matbench.drawing import style

VIEWS, PLANES, PIXELS = 3, range(1, 5), range(9)
COLOURS = ("#0072b2", "#d55e00", "#6a51a3")
POINT = (7, 2)  # column in image 0, disparity


def above(x: float, d: float) -> tuple[float, float]:
    """Where a target point is in the world: centres one baseline apart, focal length one pixel times ten."""
    depth = 10 / d
    return (x - 4) * depth / 10, depth


def rays(axes: Axes, world: bool) -> None:
    x, d = POINT
    for view, colour in enumerate(COLOURS):
        for pixel in PIXELS:
            mine = pixel == x - view * d
            near = (PLANES[-1] + 0.6) if not world else 40
            ends = [(pixel + view * level, level) for level in (0.6 if not world else 0.9, near)]
            across, along = zip(*(above(*end) if world else end for end in ends), strict=True)
            axes.plot(across, along, color=colour, lw=1.8 if mine else 0.5, alpha=1 if mine else 0.35, zorder=1)


def points(axes: Axes, world: bool) -> None:
    x, d = POINT
    for level in PLANES:
        columns = np.arange(0, PIXELS[-1] + (VIEWS - 1) * level + 1)
        across, along = zip(*(above(c, level) if world else (c, level) for c in columns), strict=True)
        axes.plot(across, along, color="#999999", lw=0.8, zorder=0)
        axes.plot(across, along, "o", color="#444444", ms=2.2, zorder=2)
    for view, colour in enumerate(COLOURS):
        hiding = [(x + view * (level - d), level) for level in PLANES if level > d]
        across, along = zip(*(above(*one) if world else one for one in hiding), strict=True)
        axes.plot(across, along, "s", color=colour, ms=6, zorder=3)
    axes.plot(*(above(x, d) if world else (x, d)), "o", color="black", ms=8, zorder=4)


@style({"svg.fonttype": "none", "svg.hashsalt": "matbench", "font.size": 9})
def main() -> None:
    figure = Figure(figsize=(9, 3.9), layout="constrained")
    scene, space = figure.subplots(1, 2)
    for axes, world in ((scene, True), (space, False)):
        rays(axes, world)
        points(axes, world)
        axes.spines[["top", "right"]].set_visible(False)
    for view, colour in enumerate(COLOURS):
        scene.plot([view], [0], marker="^", ms=10, color=colour, clip_on=False, zorder=5)
        scene.annotate(str(view), (view, 0), (0, -20), textcoords="offset points", ha="center", color=colour)
    scene.set(title="the scene from above", xlim=(-4.5, 9), ylim=(0, 10.8), xticks=[], ylabel="depth")
    scene.set_xlabel("centres of images 0, 1, 2", labelpad=24)
    scene.set_yticks([10 / d for d in PLANES], [f"d = {d}" for d in PLANES])
    space.set(title="disparity space", xlabel="x, column in image 0", ylabel="disparity d", xlim=(-0.8, 16.8))
    space.set_yticks(list(PLANES), [f"d = {d}" for d in PLANES])
    space.invert_yaxis()  # near below, as in the scene
    figure.savefig(Path(__file__).parent / "images" / "disparity-space.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
