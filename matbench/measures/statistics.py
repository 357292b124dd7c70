"""How large a difference between two methods is, and whether the scenes suffice to call it real."""

from collections.abc import Sequence
from functools import cache
from itertools import combinations_with_replacement
from math import factorial, fsum, prod, sqrt

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

FEW = 6
"""With fewer scenes there is no verdict: even if all five agree in sign, chance alone does that once in 16 runs."""

CONFIDENCE = 0.95

EXACT = 7
"""Up to this many scenes all resamples are taken (7**7 of them); for more scenes `_RESAMPLES` are drawn."""

_RESAMPLES = 4999
_BATCH = 256  # rows at once: bounds the memory that many take


@frozen
class Effect:
    """A mean difference over scenes.

    Parameters
    ----------
    mean
        Mean of the differences, in the metric's unit.
    low, high
        Its bootstrap interval over scenes (percentiles, `CONFIDENCE`); NaN with fewer than two.
    size
        The mean over the standard deviation of the differences (Cohen's d for paired samples);
        infinite where all scenes agree exactly, NaN with fewer than two scenes or no difference.
    scenes
        How many scenes it is over.
    """

    mean: float
    low: float
    high: float
    size: float
    scenes: int

    @property
    def verdict(self) -> str:
        """``lower``, ``higher``, ``undecided`` where the interval holds 0; ``too few scenes`` below `FEW`."""
        if self.scenes < FEW:
            return "too few scenes"
        if self.high < 0:
            return "lower"
        return "higher" if self.low > 0 else "undecided"


def paired_effect(differences: Sequence[float]) -> Effect:
    """The effect that one difference per scene shows; NaN differences are left out.

    Scenes are resampled, not pixels: pixels of one scene are no independent witnesses. The same differences give
    the same interval to the last bit, in whatever order the scenes stand; taken the other way round, its negative.
    """
    return paired_effects([differences])[0]


def paired_effects(rows: Sequence[Sequence[float] | NDArray[np.float64]]) -> list[Effect]:
    """`paired_effect` of each, with all bootstraps over equally many scenes done at once."""
    values = [np.asarray(row, np.float64) for row in rows]
    values = [settled(row[np.isfinite(row)]) for row in values]
    ends = dict.fromkeys(range(len(values)), (float("nan"), float("nan")))
    for count in {row.size for row in values} - {0, 1}:
        places = [i for i, row in enumerate(values) if row.size == count]
        low, high = intervals(np.stack([values[i] for i in places]))
        ends |= {i: (float(a), float(b)) for i, a, b in zip(places, low, high, strict=True)}
    return [_effect(row, *ends[i]) for i, row in enumerate(values)]


def settled(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Differences, or scores, without their last bits, which depend on the order in which sums were taken.

    Parameters
    ----------
    values
        (..., scenes) float64, all finite; each row keeps 12 digits of its largest number.

    >>> float(settled(np.array([0.1 + 0.2]))[0])
    0.3
    """
    largest = np.abs(values).max(axis=-1, keepdims=True, initial=1e-280)
    digits = 11 - np.floor(np.log10(largest))
    up, down = 10.0 ** np.maximum(digits, 0), 10.0 ** np.maximum(-digits, 0)
    kept: NDArray[np.float64] = np.rint(values / down * up) / up * down
    return kept


def _effect(values: NDArray[np.float64], low: float, high: float) -> Effect:
    count = int(values.size)
    # exact sums: neither order nor sign matters
    power = int(np.frexp(np.abs(values).max(initial=0.0))[1])  # for squares that stay in range, whatever the numbers
    small = np.ldexp(values, -power)
    part = fsum(small) / count if count else float("nan")
    mean = float(np.ldexp(part, power))
    spread = float(np.ldexp(sqrt(fsum((small - part) ** 2) / (count - 1)), power)) if count > 1 else float("nan")
    if spread == 0:  # all scenes agree
        return Effect(mean, mean, mean, float(np.sign(mean) * np.inf) if mean else float("nan"), count)
    return Effect(mean, low, high, mean / spread, count)


def intervals(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper ends of the bootstrap intervals of means over the last axis, the scenes.

    Percentiles of the resamples' means, `CONFIDENCE` (Efron 1979): of all resamples up to `EXACT` scenes, else of
    seeded draws. They depend neither on the order of the scenes nor on which of two methods is subtracted.

    Parameters
    ----------
    values
        (..., scenes) float64, at least two scenes, all finite.
    """
    scenes = values.shape[-1]
    # Sums round, and scenes are drawn by their place. So that the order of the scenes and the sign of the differences
    # do not matter, each row is brought into one order and one sign first.
    rows = np.sort(values.reshape(-1, scenes), axis=1)
    turned = -rows[:, ::-1]
    first = (rows != turned).argmax(axis=1)[:, None]
    flipped = np.take_along_axis(rows < turned, first, axis=1)
    rows = np.where(flipped, turned, rows)
    ends = np.empty((len(rows), 2))
    for start in range(0, len(rows), _BATCH):
        batch = slice(start, start + _BATCH)
        ends[batch] = _percentiles(rows[batch])
    ends = np.where(flipped, -ends[:, ::-1], ends)
    low, high = ends.T.reshape(2, *values.shape[:-1])
    return low, high


def _percentiles(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """(rows, 2): the ends of each row's interval, linear between order statistics."""
    scenes = rows.shape[1]
    tails = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    if scenes > EXACT:
        drawn: NDArray[np.float64] = np.quantile(_means(rows, _draws(scenes)), tails, axis=-1).T
        return drawn
    shares, times = _all_resamples(scenes)
    means = _means(rows, shares)
    order = np.argsort(means, axis=1)
    means, passed = np.take_along_axis(means, order, axis=1), np.cumsum(times[order], axis=1)
    ends = np.empty((len(rows), 2))
    for tail, share in enumerate(tails):
        place = share * (scenes**scenes - 1)
        below, above = (
            np.take_along_axis(means, (passed <= k).sum(axis=1, keepdims=True), axis=1)[:, 0]
            for k in (int(place), min(int(place) + 1, scenes**scenes - 1))
        )
        ends[:, tail] = below + (above - below) * (place - int(place))
    return ends


def _means(rows: NDArray[np.float64], shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """(rows, resamples) means. They are summed scene by scene: how a matrix product rounds depends on its size."""
    means = np.zeros((len(rows), len(shares)))
    for values, share in zip(rows.T, shares.T, strict=True):
        means += values[:, None] * share
    return means


@cache
def _draws(scenes: int) -> NDArray[np.float64]:
    """(`_RESAMPLES`, scenes) share of each scene in each drawn resample."""
    draws = np.random.default_rng(0).integers(0, scenes, (_RESAMPLES, scenes))
    share = np.zeros((_RESAMPLES, scenes))
    np.add.at(share, (np.arange(_RESAMPLES)[:, None], draws), 1 / scenes)
    return share


@cache
def _all_resamples(scenes: int) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """All resamples apart from order: (resamples, scenes) share of each scene, and (resamples,) how many orders.

    >>> _all_resamples(2)[0].tolist(), _all_resamples(2)[1].tolist()
    ([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]], [1, 2, 1])
    """
    chosen = np.array(list(combinations_with_replacement(range(scenes), scenes)))
    often = (chosen[:, :, None] == np.arange(scenes)).sum(axis=1)
    orders = [factorial(scenes) // prod(map(factorial, row)) for row in often.tolist()]
    return often / scenes, np.array(orders, np.intp)


def median_interval(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """The median, and two values around it that enclose the true median with probability `CONFIDENCE` or more.

    This holds for any distribution, because the number of values below its median is binomial.
    """
    from scipy.stats import binom

    ordered = np.sort(values)
    below = max(0, int(binom.ppf((1 - CONFIDENCE) / 2, ordered.size, 0.5)) - 1)
    return float(np.median(ordered)), float(ordered[below]), float(ordered[-1 - below])
