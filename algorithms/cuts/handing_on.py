"""What nodes have is handed on before any path is looked for: another network with the same minimal cuts."""

from matbench.algorithms.cuts.network import UNLIMITED
from matbench.algorithms.kernels import kernel

MOST = 2 * UNLIMITED  # what a node holds at most, so that it fits into 32 bits


@kernel
def hand_on(start, head, sister, capacity, excess, sweeps):  # type: ignore[no-untyped-def]
    """Every node gives what it has, or lacks, to those after it; then, from the last one on, to those before it.

    What is handed on uses up the capacity of an arc, and frees that of its sister. All cuts then cost more or less by
    the same amount, so that the minimal ones stay what they are; but most of what the source gives has met
    what the sink takes.

    Parameters
    ----------
    start, head, sister, capacity, excess
        As in `Network`. Capacities and excesses change.
    sweeps
        How often in either direction, at most; it ends when nothing is left that lacks, or that has.
    """
    nodes = excess.size
    for sweep in range(2 * sweeps):
        forward = sweep % 2 == 0
        having, lacking = False, False
        for turn in range(nodes):
            u = turn if forward else nodes - 1 - turn
            left = excess[u]
            for a in range(start[u], start[u + 1]):
                if left == 0:
                    break
                v = head[a]
                if (v > u) != forward:
                    continue
                back = sister[a]
                if left > 0:
                    given = min(left, capacity[a], MOST - max(excess[v], 0))
                else:
                    given = -min(-left, capacity[back], MOST + min(excess[v], 0))
                capacity[a] -= given
                capacity[back] += given
                left -= given
                excess[v] += given
            excess[u] = left
            having |= left > 0
            lacking |= left < 0
        if not (having and lacking):
            break
