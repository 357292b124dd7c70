"""How large a difference between two methods is, and whether the scenes suffice to call it real."""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

FEW = 6
"""Fewer scenes than these carry no conclusion: even if all agreed in sign, chance does so in 1 of 16 runs."""

CONFIDENCE = 0.95
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

    Scenes are resampled, not pixels: pixels of one scene are no independent witnesses. The same
    differences give the same interval.
    """
    return paired_effects([differences])[0]


def paired_effects(rows: Sequence[Sequence[float] | NDArray[np.float64]]) -> list[Effect]:
    """`paired_effect` of each, with all bootstraps over equally many scenes done at once."""
    values = [np.asarray(row, np.float64) for row in rows]
    values = [row[np.isfinite(row)] for row in values]
    ends = dict.fromkeys(range(len(values)), (float("nan"), float("nan")))
    for count in {row.size for row in values} - {0, 1}:
        places = [i for i, row in enumerate(values) if row.size == count]
        low, high = intervals(np.stack([values[i] for i in places]))
        ends |= {i: (float(a), float(b)) for i, a, b in zip(places, low, high, strict=True)}
    return [_effect(row, *ends[i]) for i, row in enumerate(values)]


def _effect(values: NDArray[np.float64], low: float, high: float) -> Effect:
    count = int(values.size)
    mean = float(values.mean()) if count else float("nan")
    spread = float(values.std(ddof=1)) if count > 1 else float("nan")
    if spread == 0:  # all scenes agree
        return Effect(mean, mean, mean, float(np.sign(mean) * np.inf) if mean else float("nan"), count)
    return Effect(mean, low, high, mean / spread, count)


def intervals(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper ends of the bootstrap intervals of means over the last axis, the scenes.

    Percentiles, `CONFIDENCE`. Scenes are resampled, seeded: every row by the same draws.

    Parameters
    ----------
    values
        (..., scenes) float64, at least two scenes, all finite.
    """
    scenes = values.shape[-1]
    draws = np.random.default_rng(0).integers(0, scenes, (_RESAMPLES, scenes))
    # how often each resample holds each scene: all its means are then one product of matrices
    share = np.zeros((_RESAMPLES, scenes))
    np.add.at(share, (np.arange(_RESAMPLES)[:, None], draws), 1 / scenes)
    rows = values.reshape(-1, scenes)
    ends = np.empty((2, len(rows)))
    tails = [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]
    for first in range(0, len(rows), _BATCH):
        batch = slice(first, first + _BATCH)
        ends[:, batch] = np.quantile(rows[batch] @ share.T, tails, axis=-1)
    low, high = ends.reshape(2, *values.shape[:-1])
    return low, high


def median_interval(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """The median, and the order statistics around it that hold the true one with `CONFIDENCE` or more.

    Whatever the distribution, the number of values below its median is binomial.
    """
    from scipy.stats import binom

    ordered = np.sort(values)
    below = max(0, int(binom.ppf((1 - CONFIDENCE) / 2, ordered.size, 0.5)) - 1)
    return float(np.median(ordered)), float(ordered[below]), float(ordered[-1 - below])
