"""Voxel colouring (Seitz & Dyer 1999) in disparity space."""

from functools import partial

import numpy as np
from attrs import field, frozen, validators

from matbench.algorithm import Context, Estimate
from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.kernels import add, helper, kernel, literal
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, odd, planes_a_pixel
from matbench.algorithms.sampling import fine_rows, search_space
from matbench.scene import Scene
from matbench.space import Volume


@frozen
class VoxelColoring:
    """Planes from near to far: a voxel whose unmarked pixels agree is coloured and marks them.

    With S(s, w) the views that hold the pixel w beside the voxel s and have it still unmarked, and
    m(s, w) their number, the voxel is consistent if m(s, 0) >= 2 and the standard deviation pooled
    over a window W and the three colours passes:

    sigma(s)^2 = sum over w, colours, i in S of (I_i - mean over S of I_i)^2 / sum over w of 3 * (m(s, w) - 1)

    sigma(s) <= threshold. Window pixels seen by fewer than two views add nothing. All tests of a
    plane come before its marks. Voxels lie at every sample of the finer rows
    (docs/concepts/disparity-space.md), so each pixel of each view meets exactly one voxel of a plane
    and hides all those behind it.

    Source: S. M. Seitz, C. R. Dyer, "Photorealistic scene reconstruction by voxel coloring",
    IJCV 35(2), 1999; pooling over a window is an addition, see docs/concepts/methods.md.

    Parameters
    ----------
    threshold
        Largest standard deviation of a consistent voxel, in grey levels.
    window
        Side of the window W in pixels, odd; 1 is the method as published.
    fill
        Fill what nothing coloured from the farther side of its row?
    views
        At most how many views, chosen by `Scene.widest`; 0 for all.
    fineness
        Planes per pixel of view step; 0 makes them at most one pixel of the field's pair apart.
    """

    threshold: float = field(default=4.0, validator=validators.ge(0))
    window: int = field(default=3, validator=odd)
    fill: bool = False
    views: int = field(default=0, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view (NaN where nothing coloured it) and the 0/1 occupancy."""
        kept = scene.widest(self.views or scene.n)
        chosen = scene.choose(kept)
        space = search_space(chosen, self.fineness)
        q = space.fineness
        images = fine_rows(chosen.views, q)
        unmarked = np.ones((space.views, space.rows, space.samples), np.float32)
        occupied = np.zeros(space.shape, np.float32)
        nearest = np.full((space.rows, space.width), np.nan, np.float32)
        sums = np.empty((3, space.rows, space.columns), np.float32)
        radius, variance = self.window // 2, np.float32(self.threshold) ** 2
        tested = np.zeros(space.rows, np.int64)

        for plane in reversed(range(space.planes)):
            starts = np.array([space.start(view, plane) for view in range(space.views)])
            coloured = occupied[:, plane]
            measure = partial(pool_rows, images, unmarked, starts, radius, q, sums)
            over_rows(measure, space.rows, context.threads)  # all of the plane before its first mark
            colour = partial(colour_rows, sums, starts, radius, variance, unmarked, coloured, tested)
            over_rows(colour, space.rows, context.threads)
            found = coloured[:, space.frustum(chosen.ref, plane)][:, ::q] > 0
            nearest[found & np.isnan(nearest)] = space.disparities[plane]
        disparity = nearest / np.float32(kept[1] - kept[0])
        return Estimate(
            {scene.ref: fill_from_background(disparity) if self.fill else disparity},
            Volume(space, occupied, kept),
            work={
                "voxels_tested": int(tested.sum()),
                "voxels_coloured": int(occupied.sum(dtype=np.int64)),
                "volume_bytes": occupied.nbytes,
            },
        )


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
def colour_rows(sums, starts, radius, variance, unmarked, occupied, tested, first, end):  # type: ignore[no-untyped-def]
    """Colour one plane's consistent voxels and mark their pixels, for a block of rows.

    Parameters
    ----------
    sums, starts, radius, first, end
        See `pool_rows`; all rows that the windows reach must have been pooled.
    variance
        Largest pooled variance of a consistent voxel, in squared grey levels.
    unmarked
        (n, H, S) float32, set to 0 where a voxel has been coloured.
    occupied
        (H, columns) float32, set to 1 there.
    tested
        (H,) int64, grows by the number of voxels with at least two unmarked pixels.
    """
    views, height, samples = unmarked.shape
    columns = occupied.shape[1]
    squares = np.empty(columns, np.float32)
    freedom = np.empty(columns, np.float32)
    for y in range(first, end):
        squares[:], freedom[:] = 0, 0
        for near in range(max(0, y - radius), min(height, y + radius + 1)):
            add(sums[1, near], squares)
            add(sums[2, near], freedom)
        for x in range(columns):
            if sums[0, y, x] >= 2:
                tested[y] += 1
                occupied[y, x] = squares[x] <= variance * freedom[x]
        for view in range(views):
            _mark(occupied[y, starts[view] : starts[view] + samples], unmarked[view, y])
