"""Differences that are insensitive to sampling: of ranges of colours, rather than of colours.

S. Birchfield, C. Tomasi, "A pixel dissimilarity measure that is insensitive to image sampling", IEEE PAMI 20(4), 1998.
"""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel
from matbench.algorithms.sweep import Sweep

MOST = 30.0  # grey levels that a colour differs by at most, as in the authors' program


@frozen(eq=False)
class Ranges:
    """The colours around each pixel of all views: from the least to the largest.

    Parameters
    ----------
    least, largest
        (views, q, 3, H, W) float32, of a sample and the places half-way to its four neighbours, a pixel away.
    """

    least: NDArray[np.float32]
    largest: NDArray[np.float32]

    @classmethod
    def of(cls, phases: NDArray[np.float32]) -> "Ranges":
        """The ranges of (views, q, 3, H, W) samples, see `by_phase`."""
        least, largest = phases.copy(), phases.copy()
        for axis in (3, 4):
            last = phases.shape[axis] - 1
            before, after = (np.take(phases, range(one, last + one), axis) for one in (0, 1))
            between = (before + after) / np.float32(2)
            if axis == 4:  # between pixels, the last column lies outside the picture, and is nobody's neighbour
                between[:, 1:, ..., last - 1 :] = before[:, 1:, ..., last - 1 :]
            for one in (0, 1):
                place = (slice(None),) * axis + (slice(one, last + one),)
                np.minimum(least[place], between, out=least[place])
                np.maximum(largest[place], between, out=largest[place])
        return cls(least, largest)

    def difference(self, sweep: Sweep, view: int, plane: int) -> NDArray[np.float32]:
        """(H, W) squared difference of every pixel of the reference view and its homologue; NaN outside that view."""
        here, phase, there = sweep.homologues(view, plane)
        out = np.full((sweep.space.rows, sweep.space.width), np.nan, np.float32)
        kinds = sweep.phases, self.least, self.largest
        ours = (kind[sweep.scene.ref, 0, :, :, here] for kind in kinds)
        theirs = (kind[view, phase, :, :, there] for kind in kinds)
        compare_ranges(*ours, *theirs, out[:, here])
        return out


@kernel
def compare_ranges(one, one_least, one_largest, other, other_least, other_largest, out):  # type: ignore[no-untyped-def]
    """out <- by how much the pixels of two views (3, H, W) differ: (H, W), squared, the mean over the colours.

    A colour differs by how far it is from the range of the other one, either way; the less counts.
    """
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            total = np.float32(0)
            for c in range(one.shape[0]):
                forth = max(one[c, y, x] - other_largest[c, y, x], other_least[c, y, x] - one[c, y, x])
                back = max(other[c, y, x] - one_largest[c, y, x], one_least[c, y, x] - other[c, y, x])
                gap = min(max(min(forth, back), np.float32(0)), np.float32(MOST))
                total += gap * gap
            out[y, x] = total / np.float32(one.shape[0])
