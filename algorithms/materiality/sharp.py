"""The energy without its reward for vagueness: equal to equation 5 on maps of zeros and ones, but linear between."""

from functools import cached_property

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import fill, helper, kernel
from matbench.algorithms.materiality.energy import descend, see_row
from matbench.algorithms.materiality.objective import Energy
from matbench.algorithms.materiality.passes import Floats
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import FULL

ROUND = 0.1  # differences of materialities below this count less than their amount, so that there is a derivative


@helper
def _reward(mu, vi, vj, rho, scale, slope, pull_i, pull_j):  # type: ignore[no-untyped-def]
    """A pair in one plane: its sum of (1 - 2 rho) mu V_i V_j; `slope` and `pull` gain the derivatives by mu
    and, as far as the point is material, by V."""
    kind = mu.dtype.type
    energy, one, two = kind(0), kind(1), kind(2) * scale
    for x in range(mu.size):
        r = one - two * kind(rho[x])
        both = vi[x] * vj[x]
        energy += r * mu[x] * both
        slope[x] += r * both
        pull_i[x] += r * vj[x]
        pull_j[x] += r * vi[x]
    return energy


@helper
def _shade(mu, through, slope, pull, behind):  # type: ignore[no-untyped-def]
    """What lies behind pulls at a point (equation 9), and the point at what lies before it (equation 10)."""
    for x in range(mu.size):
        a = behind[x]
        slope[x] -= through[x] * a
        behind[x] = a + mu[x] * (pull[x] - a)


@helper
def _lean(here, other, weights, strength, slope):  # type: ignore[no-untyped-def]
    """Sum of strength w |here - other|, rounded below `ROUND`; `slope` gains its derivative by `here`."""
    kind = here.dtype.type
    energy, one, half, steep = kind(0), kind(1), kind(ROUND / 2), kind(1 / ROUND)
    for x in range(here.size):
        d = here[x] - other[x]
        t = min(max(d * steep, -one), one)
        s = strength * kind(weights[x]) * t
        slope[x] += s
        energy += s * (d - half * t)
    return energy


@kernel
def sharp_rows(at, rho, scale, pairs, views, first, origin, samples, ties, bias, step, top, end, new, slopes, sums):  # type: ignore[no-untyped-def]
    """Energies and gradient at the point `at` in the rows top..end, and the step from there.

    Parameters
    ----------
    ties
        Edge weights down and right as from `edge_weights`, without planes where nothing is tied, and the strength of
        one unit of either.
    bias
        (rows,) what the count term adds to the slope of every point of a row.
    new
        (rows, planes, columns), overwritten with the stepped materialities; not `at`.
    slopes
        The same shape, overwritten with dE/dmu, or None.
    sums
        (rows, 2), overwritten: data without its constant, and ties.
    """
    rows, planes, columns = at.shape
    down, right, across, along = ties
    kind = at.dtype.type
    zero, one = kind(0), kind(1)
    seen, behind = np.empty((views, planes, samples), at.dtype), np.empty((views, samples), at.dtype)
    pulls, slope = np.empty((views, columns), at.dtype), np.empty(columns, at.dtype)
    for y in range(top, end):
        see_row(at[y], first, origin, one, seen)
        for i in range(views):
            fill(zero, behind[i])
        data, tied = 0.0, 0.0
        for k in range(planes):
            here = at[y, k]
            fill(zero, slope)
            for i in range(views):
                fill(zero, pulls[i])
            if down.shape[1] > 0:
                if y > 0:
                    _lean(here, at[y - 1, k], down[y - 1, k], across, slope)
                if y + 1 < rows:
                    tied += _lean(here, at[y + 1, k], down[y, k], across, slope)
                beside = right[y, k, 1:columns]
                _lean(here[1:], here[:-1], beside, along, slope[1:])
                tied += _lean(here[:-1], here[1:], beside, along, slope[:-1])
            for p in range(pairs.shape[0]):
                i, j = pairs[p, 0], pairs[p, 1]
                start_i, start_j = i * (first + k) - origin, j * (first + k) - origin
                low, high = max(start_i, start_j), min(start_i, start_j) + samples
                if low < high:
                    data += _reward(
                        here[low:high],
                        seen[i, k, low - start_i : high - start_i],
                        seen[j, k, low - start_j : high - start_j],
                        rho[y, p, k, low:high],
                        scale,
                        slope[low:high],
                        pulls[i, low:high],
                        pulls[j, low:high],
                    )
            for i in range(views):
                start = i * (first + k) - origin
                inside = slice(start, start + samples)
                _shade(here[inside], seen[i, k], slope[inside], pulls[i, inside], behind[i])
            descend(here, slope, y, k, step, bias[y], new, slopes)
        sums[y, 0], sums[y, 1] = data, tied


@frozen(eq=False)
class SharpEnergy(Energy):
    """Equations 16 and 17 for one scene: `Energy` with (1 - 2 rho) mu V_i V_j and |d mu| in place of their squares.

    Where all materialities are 0 or 1 nothing changes, but for the rounding of |d mu|. Between them the squares
    reward to halve a materiality and to share it out.
    """

    scratch: list[Floats] = field(init=False, factory=list)

    @cached_property
    def _constant(self) -> float:
        """Sum of rho^2."""
        return self.scale**2 * sum(float(np.square(row, dtype=np.float32).sum(dtype=np.float64)) for row in self.rho)

    @property
    def safe_step(self) -> float:
        """Equation 11 with the curvature of the rounded differences."""
        _, planes, columns = self.space.shape
        counting = 2 * self.count * planes * columns / self.target
        return 1 / (counting + 4 * (self.across + self.along) / ROUND + 2 * len(self.pairs))

    @property
    def uncoupled(self) -> bool:
        """Rows are always taken together here."""
        return False

    def step(
        self,
        now: Floats,
        before: Floats,
        beta: float,
        step: float,
        new: Floats,
        slopes: Floats | None,
        threads: int,
        counts: NDArray[np.float64] | None = None,
        ahead: float = 0.0,  # noqa: ARG002
    ) -> dict[str, float]:
        """As `Energy.step`, but `counts` stay unknown."""
        space, kind = self.space, now.dtype.type
        if counts is not None:
            counts[1] = np.nan
        if beta and not self.scratch:
            self.scratch.append(np.empty_like(now))  # kept: fresh memory is slow
        at, held = self.scratch[0] if beta else now, np.empty(space.rows)

        def gather(top: int, end: int) -> None:
            for y in range(top, end):
                if beta:
                    np.clip(now[y] + kind(beta) * (now[y] - before[y]), 0, 1, out=at[y])
                held[y] = at[y].sum(dtype=np.float64)

        over_rows(gather, space.rows, threads)
        excess = held - self.target if self.per_row else np.full(1, held.mean() - self.target)
        bias = np.broadcast_to(self.pressure * excess, space.rows).astype(kind)
        weights = self.weights if self.tied else tuple(np.zeros((space.rows, 0, 0), np.uint8) for _ in range(2))
        ties = (*weights, kind(self.across / FULL), kind(self.along / FULL))
        sums = np.empty((space.rows, 2))

        def work(top: int, end: int) -> None:
            sharp_rows(
                at, self.rho, kind(self.scale), self.pairs, space.views, space.first, space.origin, space.samples,
                ties, bias, kind(step), top, end, new, slopes, sums,
            )  # fmt: skip

        over_rows(work, space.rows, threads)
        data, adjacent = (float(part) for part in sums.sum(axis=0))
        data += self._constant
        counted = self.count / self.target * float(np.square(excess).sum()) * (1 if self.per_row else space.rows)
        smooth = counted + adjacent
        return {"total": data + smooth, "data": data, "smooth": smooth, "count": counted, "adjacent": adjacent}
