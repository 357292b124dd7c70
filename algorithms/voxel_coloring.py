"""Voxel colouring (Seitz & Dyer 1999) and space carving (Kutulakos & Seitz 2000) in disparity space."""

from collections.abc import Mapping
from functools import partial
from typing import ClassVar, Literal, get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray
from scipy.stats import chi2

from matbench.algorithm import Context, Estimate
from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.kernels import add, helper, kernel, literal
from matbench.algorithms.noise import noise_of
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, odd, planes_a_pixel
from matbench.algorithms.sampling import fine_rows, search_space
from matbench.scene import Scene
from matbench.space import DisparitySpace, Volume

Rule = Literal["threshold", "chi_squared"]
Unseen = Literal["empty", "keep"]


@frozen
class VoxelColoring:
    """Planes from near to far: a voxel whose unmarked pixels agree is coloured and marks them.

    With S(s, w) the views that hold the pixel w beside the voxel s and have it still unmarked, and
    m(s, w) their number, the voxel is consistent if m(s, 0) >= 2 and the standard deviation pooled
    over a window W and the three colours passes:

    sigma(s)^2 = sum over w, colours, i in S of (I_i - mean over S of I_i)^2 / sum over w of 3 * (m(s, w) - 1)

    sigma(s) <= threshold. With ``rule=chi_squared`` it passes if the noise of the images explains sigma(s): the upper
    sum over noise^2 is at most the quantile 1 - significance of the chi-squared distribution that has the lower sum
    as its degrees of freedom. Window pixels seen by fewer than two views add nothing. All tests of a plane come before
    its marks. Voxels lie at every sample of the finer rows (docs/concepts/disparity-space.md), so each pixel of each
    view meets exactly one voxel of a plane and hides all those behind it.

    Source: S. M. Seitz, C. R. Dyer, "Photorealistic scene reconstruction by voxel coloring", IJCV 35(2), 1999, whose
    rule is chi_squared; pooling over a window is an addition, see docs/concepts/methods.md.

    Parameters
    ----------
    rule
        What a consistent voxel is: the fixed ``threshold``, or the ``chi_squared`` test of the source.
    threshold
        Largest standard deviation of a consistent voxel, in grey levels.
    noise
        Standard deviation of the images' noise, in grey levels; 0 estimates it from the images (`noise_of`).
    significance
        How many of the consistent voxels the test may turn away, 0 to 1.
    unseen
        A voxel with fewer than two unmarked pixels stays ``empty``, or is kept (``keep``) as nothing speaks against it.
    window
        Side of the window W in pixels, odd; 1 is the method as published.
    fill
        Fill what nothing coloured from the farther side of its row?
    views
        At most how many views, chosen by `Scene.widest`; 0 for all.
    fineness
        Planes per pixel of view step; 0 makes them at most one pixel of the field's pair apart.
    """

    rule: Rule = field(default="threshold", validator=validators.in_(get_args(Rule)))
    threshold: float = field(default=4.0, validator=validators.ge(0))
    noise: float = field(default=0.0, validator=validators.ge(0))
    significance: float = field(default=0.01, validator=[validators.gt(0), validators.lt(1)])
    unseen: Unseen = field(default="empty", validator=validators.in_(get_args(Unseen)))
    window: int = field(default=3, validator=odd)
    fill: bool = False
    views: int = field(default=0, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        if self.rule == "threshold":
            return dict.fromkeys(("noise", "significance"), "rule=chi_squared")
        return {"threshold": "rule=threshold"}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view (NaN where nothing coloured it) and the 0/1 occupancy."""
        kept = scene.widest(self.views or scene.n)
        chosen = scene.choose(kept)
        space = search_space(chosen, self.fineness)
        occupied = np.ones(space.shape, np.float32)
        limits = self._limits(chosen)
        sure = np.zeros((space.rows, space.width), np.float32)
        keep = self.unseen == "keep"
        nearest, tested = carve(chosen, space, occupied, self.window, limits, keep, context.threads, sure)
        disparity = nearest / np.float32(kept[1] - kept[0])
        return Estimate(
            {scene.ref: fill_from_background(disparity) if self.fill else disparity},
            Volume(space, occupied, kept),
            confidence={scene.ref: sure},
            work={
                "voxels_tested": tested,
                "voxels_coloured": int(occupied.sum(dtype=np.int64)),
                "volume_bytes": occupied.nbytes,
            },
        )

    def _limits(self, scene: Scene) -> NDArray[np.float32]:
        """The largest sum of squares of a consistent voxel, by its degrees of freedom."""
        freedom = np.arange(3 * (scene.n - 1) * self.window**2 + 1)
        if self.rule == "threshold":
            return np.asarray(np.float32(self.threshold) ** 2 * freedom.astype(np.float32), np.float32)
        noise = self.noise or noise_of(scene.views)
        quantiles = chi2.ppf(1 - self.significance, np.maximum(freedom, 1))
        return np.where(freedom > 0, noise**2 * quantiles, 0).astype(np.float32)


@frozen
class SpaceCarving(VoxelColoring):
    """The photo hull: what is left when every voxel that its pixels contradict is carved away.

    All voxels are solid at first. Planes go from near to far, and a voxel that at least two unmarked pixels see is
    carved unless these agree, as in `VoxelColoring`; all others stay. What is left contains every shape that agrees
    with the images. Here one sweep is enough: all that can hide a voxel is nearer, so it is decided before the voxel
    is tested, and a second sweep changes nothing.

    Source: K. N. Kutulakos, S. M. Seitz, "A theory of shape by space carving", IJCV 38(3), 2000. It is
    `VoxelColoring` with ``unseen=keep``; its parameters are the same. Flat regions and the borders of the frames
    grow forward, as hulls do.
    """

    by_default: ClassVar[bool] = False

    unseen: Unseen = field(default="keep", validator=validators.in_(get_args(Unseen)))


def carve(
    scene: Scene,
    space: DisparitySpace,
    solid: NDArray[np.float32],
    window: int,
    limits: NDArray[np.float32],
    keep: bool,
    threads: int = 1,
    sure: NDArray[np.float32] | None = None,
) -> tuple[NDArray[np.float32], int]:
    """One sweep from near to far: of the voxels that are solid, those that do not pass are emptied.

    Parameters
    ----------
    solid
        (rows, planes, columns) float32, 0 or 1; overwritten.
    window, keep
        See `VoxelColoring`, `keep` is ``unseen=keep``.
    limits
        The largest sum of squares of a voxel that passes, by its degrees of freedom.
    sure
        (H, W), written where the answer's voxel was tested, if it is given: 1 less its sum of squares as a share of the
        largest that passes.

    Returns
    -------
    (H, W) disparity of the nearest solid voxel on the reference view's rays, NaN where there is none; and how many
    voxels were tested.
    """
    q = space.fineness
    images = fine_rows(scene.views, q)
    unmarked = np.ones((space.views, space.rows, space.samples), np.float32)
    nearest = np.full((space.rows, space.width), np.nan, np.float32)
    sums = np.empty((3, space.rows, space.columns), np.float32)
    tested = np.zeros(space.rows, np.int64)
    margins = np.empty((space.rows, space.columns), np.float32)
    for plane in reversed(range(space.planes)):
        starts = np.array([space.start(view, plane) for view in range(space.views)])
        part = solid[:, plane]
        measure = partial(pool_rows, images, unmarked, starts, window // 2, q, sums)
        over_rows(measure, space.rows, threads)  # all of the plane before its first mark
        colour = partial(colour_rows, sums, starts, window // 2, limits, keep, unmarked, part, tested, margins)
        over_rows(colour, space.rows, threads)
        found = part[:, space.frustum(scene.ref, plane)][:, ::q] > 0
        new = found & np.isnan(nearest)
        nearest[new] = space.disparities[plane]
        if sure is not None:
            sure[new] = margins[:, space.frustum(scene.ref, plane)][:, ::q][new]
    return nearest, int(tested.sum())


@helper
def _add_unmarked(unmarked, red, green, blue, number, reds, greens, blues):  # type: ignore[no-untyped-def]
    """Count a view's unmarked samples in `number` and add their colours to the sums, all (S,)."""
    for x in range(unmarked.size):
        weight = unmarked[x]
        number[x] += weight
        reds[x] += weight * red[x]
        greens[x] += weight * green[x]
        blues[x] += weight * blue[x]


@literal
def _add_deviations(unmarked, red, green, blue, reds, greens, blues, squares):  # type: ignore[no-untyped-def]
    """Add a view's squared deviations from the mean colours to squares, all (S,)."""
    for x in range(unmarked.size):
        r, g, b = red[x] - reds[x], green[x] - greens[x], blue[x] - blues[x]
        squares[x] += unmarked[x] * (r * r + g * g + b * b)


@helper
def _to_mean(number, reds, greens, blues, freedom):  # type: ignore[no-untyped-def]
    """Turn sums of colours into means; freedom = 3 * (number - 1), or 0 without samples, all (columns,)."""
    for x in range(number.size):
        some = max(number[x], np.float32(1))
        reds[x] /= some
        greens[x] /= some
        blues[x] /= some
        freedom[x] = np.float32(3) * (some - np.float32(1))


@helper
def _mark(occupied, unmarked):  # type: ignore[no-untyped-def]
    """unmarked[x] <- 0 where occupied, both (S,)."""
    for x in range(unmarked.size):
        unmarked[x] *= np.float32(1) - occupied[x]


@kernel
def pool_rows(images, unmarked, starts, radius, fineness, sums, first, end):  # type: ignore[no-untyped-def]
    """Views, squared deviations and degrees of freedom of one plane's voxels, for a block of rows.

    Parameters
    ----------
    images
        (n, 3, H, S) float32, see `fine_rows`.
    unmarked
        (n, H, S) float32, 1 where no nearer voxel has marked the sample, else 0.
    starts
        (n,) column at which each view's first sample lies in this plane.
    radius, fineness
        Of the window in pixels; samples per pixel.
    sums
        (3, H, columns) float32, written: the number of views; the squared deviations and the
        degrees of freedom, both summed over the window's columns.
    first, end
        The block is rows ``first : end``.
    """
    views, _, _, samples = images.shape
    columns = sums.shape[2]
    means = np.empty((3, columns), np.float32)
    reds, greens, blues = means[0], means[1], means[2]
    squares = np.empty(columns, np.float32)
    freedom = np.empty(columns, np.float32)
    reach = radius * fineness
    for y in range(first, end):
        number = sums[0, y]
        number[:], means[:], squares[:] = 0, 0, 0
        for view in range(views):
            a, b = starts[view], starts[view] + samples
            red, green, blue = images[view, 0, y], images[view, 1, y], images[view, 2, y]
            _add_unmarked(unmarked[view, y], red, green, blue, number[a:b], reds[a:b], greens[a:b], blues[a:b])
        _to_mean(number, reds, greens, blues, freedom)
        for view in range(views):
            a, b = starts[view], starts[view] + samples
            red, green, blue = images[view, 0, y], images[view, 1, y], images[view, 2, y]
            _add_deviations(unmarked[view, y], red, green, blue, reds[a:b], greens[a:b], blues[a:b], squares[a:b])
        sums[1:, y] = 0
        for tap in range(-reach, reach + 1, fineness):
            a, b = max(0, -tap), min(columns, columns - tap)
            if a < b:
                add(squares[a + tap : b + tap], sums[1, y, a:b])
                add(freedom[a + tap : b + tap], sums[2, y, a:b])


@kernel
def colour_rows(sums, starts, radius, limits, keep, unmarked, solid, tested, margins, first, end):  # type: ignore[no-untyped-def]
    """Empty one plane's voxels that do not pass and mark the pixels of the others, for a block of rows.

    Parameters
    ----------
    sums, starts, radius, first, end
        See `pool_rows`; all rows that the windows reach must have been pooled.
    limits
        (degrees of freedom + 1,) the largest sum of squares of a consistent voxel.
    keep
        Does a voxel with fewer than two unmarked pixels stay, if a view holds it?
    unmarked
        (n, H, S) float32, set to 0 where a voxel has been coloured.
    solid
        (H, columns) float32, 0 or 1: set to 0 where a voxel does not pass.
    tested
        (H,) int64, grows by the number of solid voxels with at least two unmarked pixels.
    margins
        (H, columns) float32, written: of tested voxels that pass, how far the sum of squares is below its limit, as a
        share of that; 0 of all others.
    """
    views, height, samples = unmarked.shape
    columns = solid.shape[1]
    squares = np.empty(columns, np.float32)
    freedom = np.empty(columns, np.float32)
    unseen = np.zeros(columns, np.float32)  # what becomes of a voxel that fewer than two pixels see
    for view in range(views):
        unseen[starts[view] : starts[view] + samples] = np.float32(1 if keep else 0)
    for y in range(first, end):
        squares[:], freedom[:] = 0, 0
        for near in range(max(0, y - radius), min(height, y + radius + 1)):
            add(sums[1, near], squares)
            add(sums[2, near], freedom)
        for x in range(columns):
            margins[y, x] = 0
            if sums[0, y, x] < 2:
                solid[y, x] *= unseen[x]
            elif solid[y, x] > 0:
                tested[y] += 1
                limit = limits[np.int64(freedom[x])]
                solid[y, x] = squares[x] <= limit
                if squares[x] < limit:
                    margins[y, x] = np.float32(1) - squares[x] / limit
        for view in range(views):
            _mark(solid[y, starts[view] : starts[view] + samples], unmarked[view, y])
