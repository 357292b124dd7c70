"""The energy (equation 5) of a whole scene, its gradient, and steps along it."""

from collections.abc import Callable

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.algorithms.materiality.passes import (
    LINKS,
    Count,
    Data,
    Floats,
    Pairs,
    Point,
    Room,
    Ties,
    border_rows,
    count_rows,
    pass_rows,
)
from matbench.algorithms.parallel import over_rows, share
from matbench.algorithms.similarity import FULL
from matbench.space import DisparitySpace


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
        Their edge weights from `edge_weights`; not read where both are 0.
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
    rooms: list[Room] = field(init=False, factory=list)

    @property
    def safe_step(self) -> float:
        """A step below the inverse of the largest curvature of the terms that couple many points (equation 11)."""
        _, planes, columns = self.space.shape
        counting = 2 * self.count * planes * columns / self.target
        return 1 / (counting + 8 * (self.across + self.along) + 2 * len(self.pairs))

    @property
    def tied(self) -> bool:
        """Does a term tie adjacent points to one another?"""
        return self.across > 0 or self.along > 0

    @property
    def uncoupled(self) -> bool:
        """Can each row be minimised alone, as no term joins points of several rows?"""
        return self.per_row and not self.across

    @property
    def pressure(self) -> float:
        """The derivative of the count term where there is one point more than N: 2 lambda / N."""
        return 2 * self.count / self.target

    def terms(self, kind: type[np.floating]) -> tuple[Data, Pairs, Ties]:
        """What `pass_rows` takes for materialities of that type."""
        space, full = self.space, 1 / self.scale
        weights = self.weights if self.tied else None
        return (
            Data(self.rho, kind(full), space.views, space.samples, space.first, space.origin),
            self._pairs(),
            Ties(weights, kind(self.across * full / FULL), kind(self.along * full / FULL)),
        )

    def over_rows(self, work: Callable[[int, int, Room], None], kind: type[np.floating], threads: int) -> None:
        """Call ``work(top, end, room)`` for blocks of rows; workspaces are kept for the next pass."""

        def borrow(top: int, end: int) -> None:
            room = self.rooms.pop() if self.rooms else Room.of(self.space, np.dtype(kind))
            work(top, end, room)
            self.rooms.append(room)

        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))

    def _pairs(self) -> Pairs:
        steps = np.arange(self.space.views - 1)
        if not np.array_equal(self.pairs, np.stack([steps, steps + 1], axis=1)):
            return Pairs(self.pairs, None, None)
        if len(steps) <= LINKS and not self.tied:
            return Pairs(None, (0,) * len(steps), None)
        return Pairs(None, None, (0,) * ((len(steps) - 1) % LINKS + 1))

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
        ahead: float = 0.0,
    ) -> dict[str, float]:
        """Energies at now + beta (now - before), and a gradient step from there.

        Parameters
        ----------
        now, before
            (rows, planes, columns) materialities of this pass and of the one before.
        new
            Overwritten with the point after the step; may be `before`.
        slopes
            Overwritten with dE/dmu, unless None. All arrays have one shape and type.
        counts
            (2, rows) sums of mu in each row: at this point, NaN if they are not known, and then, overwritten, at
            new + ahead (new - now). With them, one count for all rows takes no pass over memory of its own.

        Returns
        -------
        ``total``, and its parts ``data`` and ``smooth``, the latter made of ``count`` and ``adjacent``.
        """
        space, kind = self.space, now.dtype.type
        point = Point(now, before, kind(beta))
        full, block = 1 / self.scale, share(space.rows, threads)
        sums = np.empty((space.rows, 4))
        bias = 0.0
        if not self.per_row:
            if counts is None or np.isnan(counts[0]).any():
                over_rows(lambda top, end: count_rows(point, top, end, sums[:, 2]), space.rows, threads, block)
            else:
                sums[:, 2] = counts[0]
            bias = self.pressure * (float(sums[:, 2].sum()) / space.rows - self.target)
        # rows are overwritten in place: what their neighbours in other blocks read is set aside
        beyond = np.empty((-(-space.rows // block) if self.tied else 0, 2, *now.shape[1:]), now.dtype)
        border_rows(point, block, beyond)
        terms = self.terms(kind)
        pressure = self.pressure * full / 2 if self.per_row else 0.0
        count = Count(pressure, self.target, bias * full / 2, ahead if counts is not None else -1.0)

        def work(top: int, end: int, room: Room) -> None:
            pass_rows(
                point,
                *terms,
                count,
                beyond[top // block] if self.tied else now[:2],
                kind(2 * step / full),
                top,
                end,
                room,
                new,
                slopes,
                sums,
            )

        self.over_rows(work, kind, threads)
        if slopes is not None:
            slopes *= kind(2 / full)
        if counts is not None:
            counts[1] = sums[:, 3]
        data, adjacent, total = (float(part) for part in sums[:, :3].sum(axis=0) / (full * full, full, 1))
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
