"""Nodes that no minimal cut parts become one: smaller networks with the same cuts."""

import numpy as np
from numpy.typing import NDArray

from matbench.algorithms.cuts.network import UNLIMITED
from matbench.algorithms.kernels import helper, kernel


def contract(
    excess: NDArray[np.int32], links: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Unite nodes that are linked with unlimited capacity in both directions.

    Such nodes are on the same side of every cut whose capacity is limited. What their links to another node carry adds
    up, so that a network has at most one link between two nodes.

    Parameters
    ----------
    excess
        (nodes,) int32, see `Network`.
    links
        (4, links) int32: tails, heads, and capacities in both directions. Overwritten.

    Returns
    -------
    (nodes,) int32, the place of every node among those that are left, in the order of their first ones; the excess of
    these; and (4, fewer) their links, in the place of the first of `links`.
    """
    member, left = np.empty(excess.size, np.int32), np.empty(excess.size, np.int32)
    nodes = unite(*links, member)
    count = merge(member, nodes, links, excess, left, np.zeros(nodes + 1, np.int32), np.empty_like(links))
    return member, left[:nodes], links[:, :count]


@helper
def _first(u, member):  # type: ignore[no-untyped-def]
    """The first node of those that are one with u; ways there become shorter."""
    while member[u] != u:
        member[u] = member[member[u]]
        u = member[u]
    return u


@kernel
def unite(tails, heads, forth, back, member):  # type: ignore[no-untyped-def]
    """member <- the number of each node among those that are left; returns how many these are."""
    for u in range(member.size):
        member[u] = u
    for k in range(tails.size):
        if forth[k] >= UNLIMITED and back[k] >= UNLIMITED:
            one, other = _first(tails[k], member), _first(heads[k], member)
            member[max(one, other)] = min(one, other)
    for u in range(member.size):
        member[u] = member[member[u]]  # of smaller ones it is known already
    nodes = 0
    for u in range(member.size):
        if member[u] == u:
            member[u] = nodes
            nodes += 1
        else:
            member[u] = member[member[u]]
    return nodes


@kernel
def merge(member, nodes, links, excess, left, start, sorted_links):  # type: ignore[no-untyped-def]
    """links <- those between the nodes that are left, the smaller as tail, sorted by it; returns how many.

    Parameters
    ----------
    member
        (nodes,) from `unite`.
    left
        (nodes,): excesses of those that are left, written.
    start
        (nodes left + 1,) 0.
    sorted_links
        Workspace as large as `links`.
    """
    for u in range(nodes):
        left[u] = 0
    for u in range(member.size):
        left[member[u]] += excess[u]
    parted = 0
    for k in range(links.shape[1]):
        u, v, forth, back = member[links[0, k]], member[links[1, k]], links[2, k], links[3, k]
        if u == v:
            continue
        if u > v:
            u, v, forth, back = v, u, back, forth
        links[0, parted], links[1, parted], links[2, parted], links[3, parted] = u, v, forth, back
        parted += 1
        start[u + 1] += 1
    for u in range(nodes):
        start[u + 1] += start[u]
    place = start[:-1].copy()
    for k in range(parted):
        at = place[links[0, k]]
        place[links[0, k]] += 1
        sorted_links[1, at], sorted_links[2, at], sorted_links[3, at] = links[1, k], links[2, k], links[3, k]
    # where the link to a node is, if it is one of the tail's
    found = np.full(nodes, -1, np.int32)
    count = 0
    for u in range(nodes):
        first = count
        for at in range(start[u], start[u + 1]):
            v = sorted_links[1, at]
            k = found[v]
            if k < first:
                k = found[v] = count
                count += 1
                links[0, k], links[1, k], links[2, k], links[3, k] = u, v, 0, 0
            links[2, k] = min(links[2, k] + sorted_links[2, at], UNLIMITED)
            links[3, k] = min(links[3, k] + sorted_links[3, at], UNLIMITED)
    return count
