"""Descent of the energy where nothing couples rows: all passes over a row while it is in the cache, then the next."""

import numpy as np

from matbench.algorithms.kernels import helper, kernel
from matbench.algorithms.materiality.passes import Data, Point, Ties, pass_rows

RISE = 1e-6  # but at a restart, an energy exceeds that of the pass before by at most this share

# the state of one row: the parts of its energy at the last accepted pass; momentum, beta and step of the next pass;
# whether it has stopped, and how many passes it has made
ROW = np.dtype([(name, np.float64) for name in ("data", "count", "adjacent", "momentum", "beta", "step")] + [
    ("stopped", np.int64), ("made", np.int64),
])  # fmt: skip


@kernel
def follow(total, last, momentum, beta, step, accelerated):  # type: ignore[no-untyped-def]
    """Decide whether a pass is accepted, and how the next one continues.

    If the energy rises by more than rounding, a pass with momentum is rejected, and the next one has none. A pass
    without momentum is accepted even so, but the step is halved, and later energies are compared with this one.

    Parameters
    ----------
    total, last
        Energies of this pass and of the last accepted one.
    momentum, beta, step
        Of this pass.
    accelerated
        As in `Descent`.

    Returns
    -------
    accepted, restart
        Whether the pass counts, and whether energies are compared anew from it on.
    momentum, beta, step
        Of the next pass; see `Descent`.
    """
    rises = total > last * (1 + RISE)
    if rises and beta > 0:
        return False, False, 1.0, 0.0, step
    if rises:
        step /= 2
    if accelerated:
        grown = (1 + np.sqrt(1 + 4 * momentum * momentum)) / 2
        momentum, beta = grown, (momentum - 1) / grown
    return True, rises, momentum, beta, step


@helper
def _data_of(data, y):  # type: ignore[no-untyped-def]
    """`Data` of row y alone."""
    return Data(data.rho[y : y + 1], data.full, data.views, data.samples, data.first, data.origin)


@helper
def _ties_of(ties, weights, y):  # type: ignore[no-untyped-def]
    """`Ties` of row y alone; `weights` are those in `ties`."""
    if weights is None:  # noqa: SIM108 - the compiler keeps one branch only where there are two
        edges = None
    else:
        edges = weights[0][y : y + 1], weights[1][y : y + 1]
    return Ties(edges, ties.across, ties.along)


@kernel
def descend_rows(  # type: ignore[no-untyped-def]
    now, before, data, pairs, ties, count, accelerated, tolerance, top, end, room, states, course
):
    """Passes over rows top..end, each row with a step and restarts of its own.

    Parameters
    ----------
    now, before
        (rows, planes, columns) materialities, overwritten with those of the last two passes.
    data, pairs, ties, count, room
        As in `pass_rows`.
    accelerated, tolerance
        As in `Descent`; the latter is asked of a row's energy.
    states
        (rows,) ROW: where each row's descent has come to.
    course
        (passes, 4, rows), overwritten: data, count and adjacent energy of a row at its last accepted
        pass so far, and 1 for a restart, else 0.
    """
    kind, unit = now.dtype.type, np.float64(data.full)
    weight = count.pressure / unit  # lambda / N, as the pressure is full / 2 of the derivative
    sums = np.empty((1, 4))
    for y in range(top, end):
        state, a, b = states[y], now[y : y + 1], before[y : y + 1]
        data_here, ties_here = _data_of(data, y), _ties_of(ties, ties.weights, y)
        turned = False
        for number in range(len(course)):
            restart = False
            if not state.stopped:
                pass_rows(
                    Point(a, b, kind(state.beta)), data_here, pairs, ties_here, count, a,
                    kind(2 * state.step / unit), 0, 1, room, b, None, sums,
                )  # fmt: skip
                paired, tied, excess = sums[0, 0] / (unit * unit), sums[0, 1] / unit, sums[0, 2] - count.target
                counted = weight * excess * excess
                last, total = state.data + state.count + state.adjacent, paired + counted + tied
                accepted, restart, state.momentum, state.beta, state.step = follow(
                    total, last, state.momentum, state.beta, state.step, accelerated
                )
                state.made += 1
                if accepted:
                    state.data, state.count, state.adjacent = paired, counted, tied
                    state.stopped = tolerance > 0 and 0 <= last - total < tolerance * total
                    a, b = b, a
                    turned = not turned
            course[number, 0, y], course[number, 1, y] = state.data, state.count
            course[number, 2, y], course[number, 3, y] = state.adjacent, restart
        if turned:
            for k in range(now.shape[1]):
                for x in range(now.shape[2]):
                    now[y, k, x], before[y, k, x] = before[y, k, x], now[y, k, x]
