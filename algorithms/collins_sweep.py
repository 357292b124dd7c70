"""Edges of all views that vote in a plane which sweeps through depth (Collins 1996)."""

from typing import ClassVar

import cv2
import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray
from scipy.stats import binom

from matbench.algorithm import Context, Estimate
from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, planes_a_pixel
from matbench.algorithms.sampling import OnGrid
from matbench.algorithms.sweep import Costs, Sweep
from matbench.scene import Scene

STEEP = 0.5  # the least ratio of an edge's horizontal gradient to its vertical one


@frozen
class CollinsSweep(OnGrid):
    """A plane sweeps through depth; an edge pixel is where more views have an edge than chance explains.

    Edges are found in every view (Canny's); those along the rows are left out, as they
    say nothing about depth. In each plane, the views that have an edge at the homologue of an edge pixel of the
    reference view vote for it. If each of the m views that hold the point had edges at random, in a share p of its
    pixels, v of them or more would vote with the probability P(Binomial(m, p) >= v). An edge pixel takes the plane
    where that is least, if it is below `significance` over the number of planes and no other plane is as good, but for
    the next one; then the answer lies between the two. All other pixels have no answer: judge it by ``bad_1`` and
    ``invalid``.

    Source: R. T. Collins, "A space-sweep approach to true multi-image matching", CVPR 1996. The idea is the source's;
    that the reference view's edges are asked for, the binomial model, and the constants are choices.

    Parameters
    ----------
    views
        Use at most this many of the scene's views, as widely spaced as they fit; 0 for all.
    fineness
        Planes per pixel of view step; 0 makes them at most one pixel of the field's pair apart.
    weak, strong
        Canny's thresholds of the gradient, in grey levels of the 3x3 Sobel filter.
    radius
        By how many pixels edges are made wider along the rows, to both sides. Where the views have much texture, wide
        edges meet by chance too often for any to be significant.
    significance
        How many of the pixels without a surface may get an answer, 0 to 1.
    dense
        Fill what has no answer from the farther side of its row?
    """

    by_default: ClassVar[bool] = False

    views: int = field(default=9, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)
    weak: float = field(default=50.0, validator=validators.ge(0))
    strong: float = field(default=120.0, validator=validators.ge(0))
    radius: int = field(default=0, validator=[validators.ge(0), validators.le(99)])
    significance: float = field(default=0.05, validator=[validators.gt(0), validators.lt(1)])
    dense: bool = False

    def __attrs_post_init__(self) -> None:
        if self.strong < self.weak:
            raise ValueError(f"strong is {self.strong}; it must be at least weak, {self.weak}")

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of edge pixels of the reference view, NaN elsewhere; with `dense` everywhere if there is any."""
        sweep = Sweep.of(scene, Costs(views=self.views, fineness=self.fineness))
        edges = np.stack([edges_of(image, self.weak, self.strong) for image in sweep.scene.views])
        reach = np.ones((1, 2 * self.radius + 1), np.uint8)
        wide = np.stack([np.asarray(cv2.dilate(edge.astype(np.uint8), reach), np.uint8) for edge in edges])
        asked = edges[sweep.scene.ref]
        chance = self._chance(sweep, asked, wide, context.threads)
        planes, sure = np.full(asked.shape, np.nan, np.float32), np.zeros(asked.shape, np.float32)
        digits = -np.log10(np.maximum(chance.min(axis=1), 1e-300))  # how unlikely so many votes are by chance
        sure[asked] = digits / (1 + digits)
        planes[asked] = significant(chance, self.significance / sweep.space.planes)
        disparity = sweep.disparity(planes)
        return Estimate(
            {scene.ref: fill_from_background(disparity) if self.dense else disparity},
            confidence={scene.ref: np.where(np.isfinite(planes), sure, np.float32(0))},
            work={
                "edge_pixels": int(asked.sum()),
                "edge_pixels_placed": int(np.isfinite(planes).sum()),
                "votes_asked": int(asked.sum()) * sweep.space.planes * len(sweep.others),
            },
        )

    @staticmethod
    def _chance(sweep: Sweep, asked: NDArray[np.bool_], wide: NDArray[np.uint8], threads: int) -> NDArray[np.float64]:
        """(edge pixels, planes) the probability of as many votes or more if edges were at random."""
        share, views = float(wide.mean()), len(sweep.others)
        known, votes = np.mgrid[: views + 1, : views + 1]
        table = binom.sf(votes - 1, known, share)
        chance = np.empty((int(asked.sum()), sweep.space.planes))

        def vote(first: int, end: int) -> None:
            for plane in range(first, end):
                held, found = np.zeros((2, *asked.shape), np.intp)
                for view in sweep.others:
                    here, there = sweep.whole_homologues(view, plane)
                    held[:, here] += 1
                    found[:, here] += wide[view, :, there]
                chance[:, plane] = table[held[asked], found[asked]]

        over_rows(vote, sweep.space.planes, threads, 1)
        return chance


def edges_of(image: NDArray[np.uint8], weak: float, strong: float) -> NDArray[np.bool_]:
    """(H, W) edge pixels of an (H, W, 3) view, but for those along the rows."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    across, down = (np.abs(cv2.Sobel(grey, cv2.CV_32F, *order)) for order in ((1, 0), (0, 1)))
    return np.asarray((cv2.Canny(grey, weak, strong) > 0) & (across >= STEEP * down), np.bool_)


def significant(chance: NDArray[np.float64], limit: float) -> NDArray[np.float32]:
    """(pixels,) the plane of least chance, between two neighbours if both have it; NaN if there are more, or no chance
    is below the limit.

    Parameters
    ----------
    chance
        (pixels, planes).
    """
    least = chance.min(axis=1, keepdims=True)
    best = chance == least
    first, count = best.argmax(axis=1), best.sum(axis=1)
    last = best.shape[1] - 1 - best[:, ::-1].argmax(axis=1)
    clear = (least[:, 0] < limit) & (last - first < 2) & (count <= 2)
    return np.where(clear, (first + last) / 2, np.nan).astype(np.float32)
