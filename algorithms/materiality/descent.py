"""Minimising the energy (equation 5): projected gradient, plain or accelerated, over all rows at once."""

from collections.abc import Callable
from math import sqrt

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.materiality.energy import data_row, see_row, smooth_row, total_row
from matbench.algorithms.parallel import over_rows
from matbench.algorithms.similarity import FULL
from matbench.space import DisparitySpace

RISE = 1e-6  # but at a restart, the energy exceeds that of the pass before by at most this share

Floats = NDArray[np.floating]


@helper
def _extrapolate(now, before, beta, one, out):  # type: ignore[no-untyped-def]
    """out = now + beta (now - before), kept within [0, 1]."""
    zero = one - one
    for k in range(now.shape[0]):
        a, b, c = now[k], before[k], out[k]
        for x in range(a.size):
            c[x] = min(max(a[x] + beta * (a[x] - b[x]), zero), one)


@helper
def _descend(at, slope, bias, step, one, out):  # type: ignore[no-untyped-def]
    """out = at - step (slope + bias), kept within [0, 1]."""
    zero = one - one
    for k in range(at.shape[0]):
        a, g, o = at[k], slope[k], out[k]
        for x in range(a.size):
            o[x] = min(max(a[x] - step * (g[x] + bias), zero), one)


@helper
def _keep(slope, bias, out):  # type: ignore[no-untyped-def]
    """out = slope + bias."""
    for k in range(out.shape[0]):
        for x in range(out.shape[1]):
            out[k, x] = slope[k, x] + bias


@kernel
def _count_rows(now, before, beta, one, top, end, counts):  # type: ignore[no-untyped-def]
    """Sums of the rows top..end of the extrapolated materialities."""
    mu = np.empty(now.shape[1:], now.dtype)
    for y in range(top, end):
        _extrapolate(now[y], before[y], beta, one, mu)
        counts[y] = total_row(mu)


@kernel
def _pass_rows(  # type: ignore[no-untyped-def]
    now, before, beta, rho, scale, pairs, views, samples, first, origin, pressure, target, bias,
    w_across, w_along, across, along, step, one, top, end, new, slopes, sums,
):  # fmt: skip
    """One pass over rows top..end: energies and gradient at the extrapolated point, and the step.

    Parameters
    ----------
    now, before
        (rows, planes, columns) materialities of this pass and the one before; the point is
        now + beta (now - before).
    pressure, target, bias
        The count term's derivative in a row is pressure (sum - target) + bias.
    w_across, w_along
        (rows, planes, columns) uint8 edge weights to the row below and to the next column.
    new
        (rows, planes, columns), overwritten: the stepped materialities.
    slopes
        The same shape to keep the gradient in, or (0, planes, columns) to forget it.
    sums
        (rows, 3), overwritten: E_data, adjacent-plane E_smooth and sum of mu of each row.
    """
    rows, planes, columns = now.shape
    kind = now.dtype
    seen = np.empty((views, planes, samples), kind)
    behind, pull = np.empty((views, samples), kind), np.empty((views, samples), kind)
    slope = np.empty((planes, columns), kind)
    ring = np.empty((3, planes, columns), kind)  # the extrapolated rows y - 1, y, y + 1
    coupled = across > 0 or along > 0
    ready = max(0, top - 1)
    for y in range(top, end):
        above, below = max(0, y - 1), min(rows - 1, y + 1)
        for row in range(ready, below + 1):
            _extrapolate(now[row], before[row], beta, one, ring[row % 3])
        ready = below + 1
        mu = ring[y % 3]
        see_row(mu, first, origin, one, seen)
        sums[y, 0] = data_row(mu, seen, rho[y], scale, pairs, first, origin, one, slope, behind, pull)
        sums[y, 1] = 0
        if coupled:
            sums[y, 1] = smooth_row(
                mu, ring[above % 3], ring[below % 3], w_across[above], w_across[y], w_along[y], across, along, slope
            )
        sums[y, 2] = total_row(mu)
        offset = kind.type(pressure * (sums[y, 2] - target) + bias)
        _descend(mu, slope, offset, step, one, new[y])
        if slopes.shape[0] > 0:
            _keep(slope, offset, slopes[y])


@kernel
def _mean_weights(per_view, first, origin, top, end, weights):  # type: ignore[no-untyped-def]
    """Edge weights of target points in 255ths: the mean over the views that see them."""
    views, _, samples = per_view.shape
    _, planes, columns = weights.shape
    total, count = np.empty(columns, np.float32), np.empty(columns, np.float32)
    one, full, half = np.float32(1), np.float32(FULL), np.float32(0.5)
    for y in range(top, end):
        for k in range(planes):
            total[:] = 0
            count[:] = 0
            for i in range(views):
                start = i * (first + k) - origin
                for u in range(samples):
                    total[start + u] += per_view[i, y, u]
                    count[start + u] += one
            out = weights[y, k]
            for x in range(columns):
                out[x] = np.uint8(full * total[x] / max(count[x], one) + half)


def edge_weights(
    rows: NDArray[np.float32], space: DisparitySpace, edge: float, threads: int = 1
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Weights w = exp(-|dI| / edge) between neighbouring points, averaged over the views (SPEC 4).

    Parameters
    ----------
    rows
        (views, 3, H, samples) the views' rows; |dI| is the mean over colours.
    edge
        Grey levels, over a pixel.

    Returns
    -------
    Two (rows, planes, columns) uint8 arrays in 255ths: to the next row, to the next column.
    """
    down, right = np.zeros(rows[:, 0].shape, np.float32), np.zeros(rows[:, 0].shape, np.float32)
    down[:, :-1] = np.exp(np.abs(np.diff(rows, axis=2)).mean(axis=1) / -edge)
    right[..., :-1] = np.exp(np.abs(np.diff(rows, axis=3)).mean(axis=1) * space.fineness / -edge)
    found = []
    for per_view in (down, right):
        weights = np.empty(space.shape, np.uint8)

        def fill(top: int, end: int, per_view: Floats = per_view, weights: NDArray[np.uint8] = weights) -> None:
            _mean_weights(per_view, space.first, space.origin, top, end, weights)

        over_rows(fill, space.rows, threads)
        found.append(weights)
    return found[0], found[1]


@frozen(eq=False)
class Energy:
    """Equation 5 for one scene: E = E_data + E_smooth, with E_smooth = count term + adjacent points.

    Parameters
    ----------
    space
        Its target points.
    pairs
        (pairs, 2) views compared.
    rho
        (rows, pairs, planes, columns) similarities in units of `scale`.
    target
        N, the materialities that one epipolar plane should hold.
    count
        lambda of the count term lambda / N (sum mu - N)^2 (equation 7, over N so that lambda does
        not depend on the image's size).
    per_row
        One count term for every epipolar plane; otherwise one for all, with `rows` N.
    across, along
        lambda_y and lambda_x of the squared differences to the next row and the next column.
    weights
        Their edge weights in 255ths; arrays of no rows where both are 0.
    scale
        Value of one unit of `rho`.
    """

    space: DisparitySpace
    pairs: NDArray[np.int64]
    rho: NDArray[np.uint8] | Floats
    target: float
    count: float
    per_row: bool
    across: float
    along: float
    weights: tuple[NDArray[np.uint8], NDArray[np.uint8]]
    scale: float = 1 / FULL

    @property
    def safe_step(self) -> float:
        """Below the inverse of the largest curvature of the terms that couple many points (SPEC 3)."""
        _, planes, columns = self.space.shape
        counting = 2 * self.count * planes * columns / self.target
        return 1 / (counting + 8 * (self.across + self.along) + 2 * len(self.pairs))

    def step(
        self, now: Floats, before: Floats, beta: float, step: float, new: Floats, slopes: Floats | None, threads: int
    ) -> dict[str, float]:
        """Energies at now + beta (now - before); the point after a gradient step from there goes to `new`.

        `slopes`, (rows, planes, columns), is filled with dE/dmu if given. All arrays have one type.
        """
        space, kind = self.space, now.dtype.type
        pressure = 2 * self.count / self.target
        sums = np.empty((space.rows, 3))
        bias = 0.0
        if not self.per_row:
            over_rows(
                lambda top, end: _count_rows(now, before, kind(beta), kind(1), top, end, sums[:, 2]),
                space.rows,
                threads,
            )
            bias = pressure * (float(sums[:, 2].sum()) / space.rows - self.target)
        kept = np.empty((0, *now.shape[1:]), now.dtype) if slopes is None else slopes

        def work(top: int, end: int) -> None:
            _pass_rows(
                now,
                before,
                kind(beta),
                self.rho,
                kind(self.scale),
                self.pairs,
                space.views,
                space.samples,
                space.first,
                space.origin,
                pressure if self.per_row else 0.0,
                self.target,
                bias,
                *self.weights,
                kind(self.across / FULL),
                kind(self.along / FULL),
                kind(step),
                kind(1),
                top,
                end,
                new,
                kept,
                sums,
            )

        over_rows(work, space.rows, threads)
        data, adjacent, total = (float(part) for part in sums.sum(axis=0))
        excess = (sums[:, 2] - self.target) if self.per_row else np.array([total / space.rows - self.target])
        counted = self.count / self.target * float(np.square(excess).sum())
        if not self.per_row:
            counted *= space.rows
        return {
            "total": data + counted + adjacent,
            "data": data,
            "smooth": counted + adjacent,
            "count": counted,
            "adjacent": adjacent,
        }


@frozen(eq=False)
class Descent:
    """How to minimise.

    Parameters
    ----------
    passes
        Sweeps over all points, at most.
    accelerated
        FISTA: each pass starts from now + beta (now - before); otherwise beta = 0.
    step
        Length of a gradient step.
    tolerance
        Stop when a pass lowers the energy by less than this share; 0 = never.
    threads
        The result does not depend on it.
    """

    passes: int
    accelerated: bool
    step: float
    tolerance: float = 0.0
    threads: int = 1

    def run(
        self,
        energy: Energy,
        mu: Floats,
        listener: Callable[[int, dict[str, float], Floats, Floats], None] | None = None,
    ) -> tuple[Floats, dict[str, list[float]], int]:
        """Descend from `mu`, which is overwritten.

        An accelerated pass whose energy exceeds that of the last accepted pass is rejected: the
        next one starts without momentum. If the energy rises even so, the step is halved and the
        point is accepted as a restart.

        Parameters
        ----------
        listener
            Is told pass, energies, materialities and their derivative after every accepted pass.

        Returns
        -------
        mu
            (rows, planes, columns) materialities after the last step.
        history
            Per accepted pass the energies where its gradient was taken, and ``restart`` = 1 for
            the passes from which on the energy is compared anew; else 0.
        passes
            How many passes were made, rejected ones included.
        """
        now, before, new = mu, mu.copy(), np.empty_like(mu)
        slopes = None if listener is None else np.empty_like(mu)
        history: dict[str, list[float]] = {}
        last, momentum, beta, step = np.inf, 1.0, 0.0, self.step
        made = 0
        while made < self.passes:
            made += 1
            energies = energy.step(now, before, beta, step, new, slopes, self.threads)
            rises = energies["total"] > last * (1 + RISE)
            if rises and beta > 0:
                momentum, beta = 1.0, 0.0
                continue
            energies["restart"] = float(rises)
            if rises:
                step /= 2
            for name, value in energies.items():
                history.setdefault(name, []).append(value)
            if listener is not None and slopes is not None:
                at = np.clip(now + mu.dtype.type(beta) * (now - before), 0, 1)
                listener(len(history["total"]) - 1, energies, at, slopes)
            gained = last - energies["total"]
            last = energies["total"]
            now, before, new = new, now, before
            if self.tolerance and 0 <= gained < self.tolerance * last:
                break
            if self.accelerated:
                grown = (1 + sqrt(1 + 4 * momentum * momentum)) / 2
                momentum, beta = grown, (momentum - 1) / grown
        return now, history, made
