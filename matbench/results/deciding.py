"""When to stop adding scenes: looks at a growing set that keep their error rate, however many there are.

Whoever looks after every scene, and stops when an interval leaves 0 out, finds a difference between equal methods
sooner or later. So looks are few, at `looks` scenes, and each may only err so often: the k-th, from 0, at a rate of
`level(k)`. All of these together are `SPENT`, without end, so that the chance of any wrong verdict is no larger (the
error rate is spent, as in Lan & DeMets 1983, Biometrika 70(3), here by Bonferroni's bound).

A look decides where two tests agree. One is exact for equal methods, whatever the distribution of their differences
(`matbench.measures.sign_flips`). The other is of methods that are equal on average only, whose differences may be
skewed: its interval (`matbench.measures.statistics.intervals`). At these levels intervals are repeated confidence
intervals: all of them hold at once (Jennison & Turnbull 1989, Journal of the Royal Statistical Society B 51(3)). They
are approximate where differences are skewed, so half of the error rate is left to that (`SPENT`).
"""

from collections.abc import Hashable, Iterator, Sequence
from typing import Literal

import numpy as np
from attrs import evolve, frozen

from matbench.measures.sign_flips import chance
from matbench.measures.statistics import ERROR, Effect, intervals, paired_effect, settled

FIRST = 32
"""Scenes at the first look: where one scene in five decides all, fewer may hold none of them."""

SPENT = ERROR / 2
"""What all looks may err together, for normal differences: skewed ones make it up to twice as much."""

GROWTH = 1.5
"""How many times as many scenes the next look is at."""

Why = Literal["decided", "budget", "scenes", "interrupted"]

_KEPT = 0.7  # share of what is left of the error rate that a look leaves to those after it


@frozen
class Look:
    """What is known after some scenes.

    Parameters
    ----------
    number
        Which look it is, from 0.
    effect
        The difference, judged at `level` of this look; its interval is the one that holds at all looks at once.
    """

    number: int
    effect: Effect

    @property
    def is_decided(self) -> bool:
        return self.effect.verdict in ("lower", "higher")


@frozen
class Ended:
    """How a growing run ended: what its decision can be computed from again, when its maps are scored anew.

    Parameters
    ----------
    first, second
        The methods, as tables call them.
    metric
        What was compared, in region `all`.
    number
        The last look; None if none was reached.
    why
        Why it ended: ``decided``; ``budget``; ``scenes``, there are no more; ``interrupted``.
    """

    first: str
    second: str
    metric: str
    number: int | None
    why: Why


def looks(most: int) -> list[int]:
    """At how many scenes to look, if there are `most`: the last look is at all of them.

    >>> looks(100)
    [32, 48, 72, 100]
    """
    return list(_counts(most))


def _counts(most: int) -> Iterator[int]:
    at = FIRST
    while at < most:
        yield at
        at = round(at * GROWTH)
    yield most


def level(number: int) -> float:
    """The error rate of a look, from 0.

    >>> round(sum(level(number) for number in range(1000)), 6)
    0.025
    """
    return SPENT * (1 - _KEPT) * _KEPT**number


def look(number: int, differences: Sequence[float]) -> Look:
    """Judge one difference per scene at a look; NaN differences are left out."""
    rate, found = level(number), paired_effect(differences)
    values = np.asarray(differences, np.float64)
    values = settled(values[np.isfinite(values)])
    if values.size > 1 and found.low < found.high:
        low, high = map(float, intervals(values, 1 - rate))
        if found.p < rate and (exact := chance(values)) >= rate:  # an interval that holds 0 as well holds as often
            low, high, found = min(low, 0.0), max(high, 0.0), evolve(found, p=exact)
        found = evolve(found, low=low, high=high)
    return Look(number, evolve(found, level=rate))


def places(witnesses: Sequence[Hashable]) -> list[int]:
    """After how many scenes to look, of scenes in order: where `looks` witnesses are complete.

    Parameters
    ----------
    witnesses
        Of each scene, whose witness it is: with other options a scene is no second one.

    >>> places(["a", "a", "b"] + list(range(40)))
    [33, 43]
    """
    new = [k for k, first in enumerate(_firsts(witnesses)) if first]
    return [*(new[count] for count in looks(len(new))[:-1]), len(witnesses)]


def _firsts(witnesses: Sequence[Hashable]) -> Iterator[bool]:
    seen: set[Hashable] = set()
    for one in witnesses:
        yield one not in seen
        seen.add(one)
