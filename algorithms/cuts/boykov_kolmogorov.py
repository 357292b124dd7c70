"""Maximal flow by augmenting paths between two search trees (Boykov & Kolmogorov 2004).

Y. Boykov, V. Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy minimization in
vision", IEEE PAMI 26(9), 2004. Written after the paper's description.
"""

import numpy as np

from matbench.algorithms.kernels import inlined, kernel

# what stands for the parent of a node that is a root, of one that has lost its parent, and of one in no tree
ROOT, ORPHAN, FREE = -1, -2, -3
FAR = 1 << 30


@inlined
def _activate(u, waiting, queue, state, low):  # type: ignore[no-untyped-def]
    """Append a node to the ring of nodes that may grow, unless it waits there."""
    if not waiting[u]:
        waiting[u] = True
        queue[low + state[1]] = u
        state[1] = state[1] + 1 if state[1] + 1 < state[6] else 0
        state[2] += 1


@inlined
def _orphan_first(u, parent, orphans, state, low):  # type: ignore[no-untyped-def]
    """Put a node before all others that look for a parent."""
    parent[u] = ORPHAN
    state[3] = state[3] - 1 if state[3] > 0 else state[6] - 1
    orphans[low + state[3]] = u
    state[5] += 1


@inlined
def _orphan_last(u, parent, orphans, state, low):  # type: ignore[no-untyped-def]
    """Put a node behind all others that look for a parent."""
    parent[u] = ORPHAN
    place = state[3] + state[5]
    orphans[low + (place if place < state[6] else place - state[6])] = u
    state[5] += 1


@kernel
def push_flow(start, head, sister, capacity, excess, parent, is_sink, stamp, depth, waiting, queue, orphans, low, high):  # type: ignore[no-untyped-def]
    """A maximal flow between nodes low..high; arcs from or to others carry none. Returns its value.

    Parameters
    ----------
    start, head, sister, capacity, excess
        As in `Network`. Capacities and excesses become what the flow leaves of them.
    parent, is_sink, stamp, depth, waiting, queue, orphans
        (nodes,) workspace, any content. Afterwards those nodes have a `parent` other than FREE and are not `is_sink`
        which the source reaches through what the flow leaves: the smallest source side of a minimal cut.
    """
    # ring of active nodes: first, end, number; deque of orphans: first, (unused), number; size of both
    state = np.zeros(7, np.int64)
    state[6] = high - low
    for u in range(low, high):
        stamp[u], depth[u], waiting[u], parent[u] = 0, 1, False, FREE
        is_sink[u] = excess[u] < 0
        if excess[u] != 0:
            parent[u] = ROOT
            _activate(u, waiting, queue, state, low)
    time, value, current = 0, 0, -1
    while True:
        # ---- the next node that may grow
        u = current
        if u >= 0 and parent[u] == FREE:
            u = -1
        while u < 0 and state[2] > 0:
            u = queue[low + state[0]]
            state[0] = state[0] + 1 if state[0] + 1 < state[6] else 0
            state[2] -= 1
            waiting[u] = False
            if parent[u] == FREE:
                u = -1
        if u < 0:
            break
        # ---- growth, until the trees meet
        middle = -1
        sink_tree = is_sink[u]
        for a in range(start[u], start[u + 1]):
            v = head[a]
            if v < low or v >= high or (capacity[sister[a]] if sink_tree else capacity[a]) == 0:
                continue
            if parent[v] == FREE:
                is_sink[v], parent[v] = sink_tree, sister[a]
                stamp[v], depth[v] = stamp[u], depth[u] + 1
                _activate(v, waiting, queue, state, low)
            elif is_sink[v] != sink_tree:
                middle = sister[a] if sink_tree else a
                break
            elif stamp[v] <= stamp[u] and depth[v] > depth[u]:
                parent[v], stamp[v], depth[v] = sister[a], stamp[u], depth[u] + 1
        time += 1
        if middle < 0:
            current = -1
            continue
        current = u
        # ---- augmentation along the path through `middle`
        flow = capacity[middle]
        v = head[sister[middle]]
        while parent[v] != ROOT:
            flow = min(flow, capacity[sister[parent[v]]])
            v = head[parent[v]]
        flow = min(flow, excess[v])
        v = head[middle]
        while parent[v] != ROOT:
            flow = min(flow, capacity[parent[v]])
            v = head[parent[v]]
        flow = min(flow, -excess[v])
        value += flow
        capacity[middle] -= flow
        capacity[sister[middle]] += flow
        v = head[sister[middle]]
        while parent[v] != ROOT:
            a = parent[v]
            w = head[a]
            capacity[a] += flow
            capacity[sister[a]] -= flow
            if capacity[sister[a]] == 0:
                _orphan_first(v, parent, orphans, state, low)
            v = w
        excess[v] -= flow
        if excess[v] == 0:
            _orphan_first(v, parent, orphans, state, low)
        v = head[middle]
        while parent[v] != ROOT:
            a = parent[v]
            w = head[a]
            capacity[a] -= flow
            capacity[sister[a]] += flow
            if capacity[a] == 0:
                _orphan_first(v, parent, orphans, state, low)
            v = w
        excess[v] += flow
        if excess[v] == 0:
            _orphan_first(v, parent, orphans, state, low)
        # ---- adoption of those that lost their way to a root
        while state[5] > 0:
            w = orphans[low + state[3]]
            state[3] = state[3] + 1 if state[3] + 1 < state[6] else 0
            state[5] -= 1
            sink_tree = is_sink[w]
            best, least = -1, FAR
            for a in range(start[w], start[w + 1]):
                v = head[a]
                if v < low or v >= high or (capacity[a] if sink_tree else capacity[sister[a]]) == 0:
                    continue
                if is_sink[v] != sink_tree or parent[v] == FREE:
                    continue
                # does the neighbour's way end at a root?
                steps = 0
                while True:
                    if stamp[v] == time:
                        steps += depth[v]
                        break
                    steps += 1
                    if parent[v] == ROOT:
                        stamp[v], depth[v] = time, 1
                        break
                    if parent[v] == ORPHAN:
                        steps = FAR
                        break
                    v = head[parent[v]]
                if steps < FAR:
                    if steps < least:
                        best, least = a, steps
                    v = head[a]
                    while stamp[v] != time:
                        stamp[v], depth[v] = time, steps
                        steps -= 1
                        v = head[parent[v]]
            if best >= 0:
                parent[w], stamp[w], depth[w] = best, time, least + 1
                continue
            parent[w] = FREE
            for a in range(start[w], start[w + 1]):
                v = head[a]
                if v < low or v >= high or is_sink[v] != sink_tree or parent[v] == FREE:
                    continue
                if (capacity[a] if sink_tree else capacity[sister[a]]) > 0:
                    _activate(v, waiting, queue, state, low)
                if parent[v] >= 0 and head[parent[v]] == w:
                    _orphan_last(v, parent, orphans, state, low)
    return value
