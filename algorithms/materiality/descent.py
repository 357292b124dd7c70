"""Minimising the energy (equation 5): projected gradient, plain or accelerated."""

from collections.abc import Callable

import numpy as np
from attrs import frozen

from matbench.algorithms.materiality.objective import Energy
from matbench.algorithms.materiality.passes import Count, Floats, Room
from matbench.algorithms.materiality.rows import RISE as RISE
from matbench.algorithms.materiality.rows import ROW, descend_rows, follow

Listener = Callable[[int, dict[str, float], Floats, Floats], None]


@frozen(eq=False)
class Descent:
    """How the energy is minimised.

    Parameters
    ----------
    passes
        At most this many passes over all points.
    accelerated
        FISTA (Beck & Teboulle 2009): each pass starts from now + beta (now - before); otherwise beta = 0.
    step
        Length of a gradient step.
    tolerance
        Stop when a pass lowers the energy by less than this share of it. Where rows descend independently,
        each row stops by its own energy. 0 = never.
    threads
        The result does not depend on it.
    """

    passes: int
    accelerated: bool
    step: float
    tolerance: float = 0.0
    threads: int = 1

    def run(
        self, energy: Energy, mu: Floats, listener: Listener | None = None
    ) -> tuple[Floats, dict[str, list[float]], int, int]:
        """Descend from `mu`, which is overwritten.

        An accelerated pass is rejected if its energy exceeds that of the last accepted pass, and the
        next pass starts without momentum. If the energy rises even then, the step is halved and the
        point is accepted as a restart. Where nothing couples rows, every row does this independently.

        Parameters
        ----------
        mu
            (rows, planes, columns) materialities to start from.
        listener
            Called after every accepted pass with its number, its energies, and the materialities and the
            derivative dE/dmu at the point where the gradient was taken.

        Returns
        -------
        mu
            (rows, planes, columns) materialities after the last step.
        history
            One number for each accepted pass: the energies where its gradient was taken, and ``restart``, 1 if
            the pass is a restart, else 0. Where nothing couples rows there is one for each pass, a sum over
            the rows; a row whose pass was rejected counts with its last accepted one.
        passes
            How many passes were made, rejected ones included; the most of any row.
        updates
            How many steps of single points all passes made.
        """
        told = None if listener is None else _Told(energy, mu, self.threads, listener)
        return self._row_by_row(energy, mu, told) if energy.uncoupled else self._all_rows(energy, mu, told)

    def _all_rows(
        self, energy: Energy, mu: Floats, told: "_Told | None"
    ) -> tuple[Floats, dict[str, list[float]], int, int]:
        # a pass steps into the materialities of the pass before, which nothing reads any more
        now, before = mu, np.empty_like(mu)
        history: dict[str, list[float]] = {}
        last, momentum, beta, step = np.inf, 1.0, 0.0, self.step
        made, counts = 0, np.full((2, len(mu)), np.nan)
        while made < self.passes:
            made += 1
            # where the next pass begins is known before this one: it follows from neither energy
            *_, ahead, _ = follow(0.0, np.inf, momentum, beta, step, self.accelerated)
            if told is not None:
                told.look(now, before, np.array(beta))
            energies = energy.step(now, before, beta, step, before, None, self.threads, counts, ahead)
            total = energies["total"]
            accepted, restart, momentum, beta, step = follow(total, last, momentum, beta, step, self.accelerated)
            counts[0] = counts[1] if accepted else np.nan
            if not accepted:
                continue
            energies["restart"] = float(restart)
            for name, value in energies.items():
                history.setdefault(name, []).append(value)
            if told is not None:
                told.tell(len(history["total"]) - 1, energies)
            gained, last = last - total, total
            now, before = before, now
            if self.tolerance and 0 <= gained < self.tolerance * total:
                break
        return now, history, made, made * mu.size

    def _row_by_row(
        self, energy: Energy, mu: Floats, told: "_Told | None"
    ) -> tuple[Floats, dict[str, list[float]], int, int]:
        kind, before = mu.dtype.type, np.zeros_like(mu)
        states = np.zeros(len(mu), ROW)
        states["data"], states["momentum"], states["step"] = np.inf, 1, self.step
        at_once = 1 if told is not None else self.passes
        history: dict[str, list[float]] = {}
        terms, counting = energy.terms(kind), Count(energy.pressure * (1 / energy.scale) / 2, energy.target, 0.0, -1.0)
        for first in range(0, self.passes, max(1, at_once)):
            if states["stopped"].all():
                break
            if told is not None:
                told.look(mu, before, states["beta"])
            course = np.empty((at_once, 4, len(mu)))

            def work(top: int, end: int, room: Room, course: Floats = course) -> None:
                descend_rows(
                    mu, before, *terms, counting, self.accelerated, self.tolerance, top, end, room, states, course
                )

            energy.over_rows(work, kind, self.threads)
            for number, (data, count, adjacent, restart) in enumerate(course.sum(axis=2).tolist(), first):
                if number >= states["made"].max():
                    break
                energies = {
                    "total": data + count + adjacent,
                    "data": data,
                    "smooth": count + adjacent,
                    "count": count,
                    "adjacent": adjacent,
                    "restart": float(restart > 0),
                }
                for name, value in energies.items():
                    history.setdefault(name, []).append(value)
                if told is not None:
                    told.tell(number, energies)
        made = states["made"]
        return mu, history, int(made.max()), int(made.sum()) * mu[0].size


class _Told:
    """What a listener is told of a pass."""

    # found in a pass of its own: one that keeps slopes is compiled differently and may round differently,
    # and listening must not change the answer

    def __init__(self, energy: Energy, mu: Floats, threads: int, listener: Listener):
        self._energy, self._threads, self._listener = energy, threads, listener
        self._at, self._slopes, self._unused = np.empty_like(mu), np.empty_like(mu), np.empty_like(mu)

    def look(self, now: Floats, before: Floats, beta: Floats) -> None:
        """Find the slopes at now + beta (now - before); `beta` is one number, or one for every row."""
        beta = np.broadcast_to(beta.astype(now.dtype), len(now))[:, None, None]
        with np.errstate(invalid="ignore"):  # without momentum, nothing is known about the pass before
            at = np.clip(now + beta * (now - before), 0, 1)
        np.copyto(self._at, np.where(beta > 0, at, now))
        self._energy.step(self._at, self._at, 0.0, 0.0, self._unused, self._slopes, self._threads)

    def tell(self, number: int, energies: dict[str, float]) -> None:
        """Pass on what `look` found, with the pass's number and energies."""
        self._listener(number, energies, self._at, self._slopes)
