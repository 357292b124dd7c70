"""Multi-baseline stereo by the sum of sums of squared differences (Okutomi & Kanade 1993)."""

import numpy as np
from attrs import field, frozen

from matbench.algorithm import Context, Estimate
from matbench.algorithms.kernels import add, helper, kernel, literal
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.parameters import all_or_several, odd, planes_a_pixel
from matbench.algorithms.sampling import OnGrid, by_phase, fine_rows, grid, off_grid, search_space
from matbench.algorithms.windows import square_difference
from matbench.scene import Scene, SceneError

BLOCK_ROWS = 32  # rows that one task works on: its arrays stay in the second-level cache


@frozen
class OkutomiKanade(OnGrid):
    """For each pixel of the reference view the disparity that minimises the SSSD.

    SSSD(x, d) = mean over views j != ref of
    sum over w in W of |I_ref(x + w) - I_j(x + w - (j - ref) * d)|^2, mean over the colours.

    A term whose window leaves image j is left out of the mean; the window itself ends where the
    reference image does. Of equal minima the farthest plane wins; a parabola through the minimum
    and its neighbours places the answer between the planes.

    Source: M. Okutomi, T. Kanade, "A multiple-baseline stereo", IEEE PAMI 15(4), 1993.

    Parameters
    ----------
    window
        Side of the window W in pixels, odd.
    views
        At most how many views, chosen by `Scene.widest`; 0 for all.
    fineness
        Planes per pixel of view step; 0 makes them at most one pixel of the field's pair apart.
    """

    window: int = field(default=7, validator=odd)
    views: int = field(default=0, validator=all_or_several)
    fineness: int = field(default=0, validator=planes_a_pixel)

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view; NaN only where no other view holds the window in any plane."""
        kept = scene.widest(self.views or scene.n)
        laid = grid(scene.choose(kept))
        if laid is None:
            raise SceneError(f"{scene.name}: {off_grid(scene.choose(kept))}")
        chosen, places = laid[0], np.array(laid[1])
        space = search_space(chosen, self.fineness)
        radius = self.window // 2

        disparity = np.empty((space.rows, space.width), np.float32)
        evaluations: list[int] = []

        def solve_rows(first: int, end: int) -> None:
            top, bottom = max(0, first - radius), min(space.rows, end + radius)
            phases = by_phase(fine_rows(chosen.views[:, top:bottom], space.fineness), space.fineness)
            disparity[first:end], count = sssd_minimum(
                phases, chosen.ref, places, space.first, space.planes, radius, first - top, end - first
            )
            evaluations.append(int(count))

        over_rows(solve_rows, space.rows, context.threads, BLOCK_ROWS)
        disparity /= np.float32(space.fineness * scene.pair_steps / chosen.pair_steps)
        return Estimate({scene.ref: disparity}, work={"ssd_evaluations": sum(evaluations)})


@helper
def _keep_minimum(cost, terms, plane, previous, best, before, after, place):  # type: ignore[no-untyped-def]
    """Take the costs of plane number `plane` into the running minimum and its two neighbours, all (X,).

    `previous` holds the plane before; `before` and `after` are the costs beside the minimum, `place` is its plane.
    """
    for x in range(cost.size):
        mean = cost[x] / terms[x] if terms[x] > 0 else np.float32(np.inf)
        lower = mean < best[x]
        follows = place[x] == plane - np.float32(1)
        after[x] = np.float32(np.inf) if lower else (mean if follows else after[x])
        before[x] = previous[x] if lower else before[x]
        place[x] = plane if lower else place[x]
        best[x] = mean if lower else best[x]
        previous[x] = mean


@literal
def _refine(place, best, before, after, first, out):  # type: ignore[no-untyped-def]
    """out <- plane of the minimum, moved to the vertex of the parabola through it and its neighbours."""
    for x in range(out.size):
        if place[x] < 0:
            out[x] = np.float32(np.nan)
            continue
        offset = np.float32(0)
        curvature = before[x] - np.float32(2) * best[x] + after[x]
        if curvature > 0 and np.isfinite(curvature):
            offset = np.float32(0.5) * (before[x] - after[x]) / curvature
        out[x] = np.float32(first) + place[x] + offset


@kernel
def sssd_minimum(phases, ref, places, first, planes, radius, top, rows):  # type: ignore[no-untyped-def]
    """Plane of the smallest SSSD for a block of rows, refined by a parabola.

    Parameters
    ----------
    phases
        (n, q, 3, R, W) float32, see `by_phase`: the block's rows and those its windows reach.
    ref
        Index of the reference view.
    places
        (n,) where each view lies, in view steps.
    first, planes
        Number of the farthest plane (disparity ``first / q``) and how many planes there are.
    radius
        Of the window, in pixels.
    top, rows
        The block is rows ``top : top + rows`` of the R.

    Returns
    -------
    plane : (rows, W) float32
        In units of planes, NaN where no window could be compared.
    evaluations : int
        How many sums of squared differences over a window it took.
    """
    views, fineness, _, height, width = phases.shape
    squares = np.empty((height, width), np.float32)
    column = np.zeros(width + 2 * radius, np.float32)  # its ends stay 0: windows end with the image
    cost = np.empty((rows, width), np.float32)
    terms = np.empty(width, np.float32)
    previous = np.full((rows, width), np.inf, np.float32)
    best = np.full((rows, width), np.inf, np.float32)
    before = np.full((rows, width), np.inf, np.float32)
    after = np.full((rows, width), np.inf, np.float32)
    place = np.full((rows, width), -2, np.float32)
    evaluations = 0
    for plane in range(planes):
        cost[:] = 0
        terms[:] = 0
        for view in range(views):
            # sample q * (x + whole) + phase of this view is the homologue of pixel x
            shift = (places[ref] - places[view]) * (first + plane)
            whole, phase = shift // fineness, shift % fineness
            seen = max(0, -whole)
            end = min(width, width - whole - (1 if phase else 0))
            left = seen if seen == 0 else seen + radius
            right = end if end == width else end - radius
            if view == ref or left >= right:
                continue
            for y in range(height):
                square_difference(
                    phases[ref], phases[view], 0, seen, phase, seen + whole, y, (0, 0, 0), np.float32(np.inf),
                    squares[y, seen:end],
                )  # fmt: skip
            for y in range(rows):
                inside = column[radius + seen : radius + end]
                inside[:] = 0
                for near in range(max(0, top + y - radius), min(height, top + y + radius + 1)):
                    add(squares[near, seen:end], inside)
                for tap in range(2 * radius + 1):
                    add(column[left + tap : right + tap], cost[y, left:right])
            terms[left:right] += np.float32(1)
            evaluations += rows * (right - left)
        for y in range(rows):
            _keep_minimum(cost[y], terms, np.float32(plane), previous[y], best[y], before[y], after[y], place[y])
    out = np.empty((rows, width), np.float32)
    for y in range(rows):
        _refine(place[y], best[y], before[y], after[y], first, out[y])
    return out, evaluations
