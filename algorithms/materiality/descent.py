"""Minimising the energy (equation 5): projected gradient, plain or accelerated, over all rows at once."""

from collections.abc import Callable
from math import sqrt

import numpy as np
from attrs import frozen

from matbench.algorithms.materiality.passes import Energy, Floats

RISE = 1e-6  # but at a restart, the energy exceeds that of the pass before by at most this share


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
        # a pass steps into the materialities of the pass before, which nothing reads any more
        now, before = mu, np.empty_like(mu)
        told = None if listener is None else (np.empty_like(mu), np.empty_like(mu), np.empty_like(mu))
        history: dict[str, list[float]] = {}
        last, momentum, beta, step = np.inf, 1.0, 0.0, self.step
        made = 0
        while made < self.passes:
            made += 1
            if told is not None:
                at, slopes, unused = told
                np.copyto(at, np.clip(now + mu.dtype.type(beta) * (now - before), 0, 1) if beta else now)
                # a pass of its own, as one that keeps slopes may be compiled to round otherwise
                energy.step(now, before, beta, step, unused, slopes, self.threads)
            energies = energy.step(now, before, beta, step, before, None, self.threads)
            rises = energies["total"] > last * (1 + RISE)
            if rises and beta > 0:
                momentum, beta = 1.0, 0.0
                continue
            energies["restart"] = float(rises)
            if rises:
                step /= 2
            for name, value in energies.items():
                history.setdefault(name, []).append(value)
            if listener is not None and told is not None:
                at, slopes, _ = told
                listener(len(history["total"]) - 1, energies, at, slopes)
            gained = last - energies["total"]
            last = energies["total"]
            now, before = before, now
            if self.tolerance and 0 <= gained < self.tolerance * last:
                break
            if self.accelerated:
                grown = (1 + sqrt(1 + 4 * momentum * momentum)) / 2
                momentum, beta = grown, (momentum - 1) / grown
        return now, history, made
