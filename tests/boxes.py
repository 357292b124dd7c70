"""A box before a wall, of known truth, and methods that are tried on it."""

import numpy as np

from matbench.algorithms.materiality import Materiality
from matbench.scene import Range, Scene

FISTA = Materiality(optimiser="fista", passes=5, views=5)


def box_before_wall(n=4, height=24, width=40, wall=1, box=4, ref=1, seed=0, margin=1):
    """Textured planes at whole disparities; the box hides the wall, and truth is exact."""
    rng = np.random.default_rng(seed)
    reach = n * (abs(wall) + abs(box)) + width
    far, near = rng.integers(0, 256, (2, height, width + 2 * reach, 3), dtype=np.uint8)
    columns = np.arange(width)
    rows = slice(height // 4, 3 * height // 4)
    views, truth = [], {}
    for j in range(n):
        # x_j = x_ref - (j - ref) d, so column x of view j shows the texture's column x + (j - ref) d
        image = far[:, reach + columns + (j - ref) * wall].copy()
        inside = columns + (j - ref) * box
        covered = (inside >= width // 3) & (inside < 2 * width // 3)
        image[rows, covered] = near[rows][:, reach + inside[covered]]
        views.append(image)
        truth[j] = np.full((height, width), wall, np.float32)
        truth[j][rows, covered] = box
    least, largest = min(wall, box) - margin, max(wall, box) + margin
    return Scene("box", np.stack(views), tuple(map(str, range(n))), ref, Range(least, largest), truth, 1.0)
