"""How large a difference between two methods is, and whether the scenes suffice to call it real."""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

FEW = 6
"""Fewer scenes than these carry no conclusion: even if all agreed in sign, chance does so in 1 of 16 runs."""

CONFIDENCE = 0.95
_RESAMPLES = 4999
_BATCH = 256  # resamples at once: bounds the memory that many rows take


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
    values = np.asarray(differences, np.float64)
    values = values[np.isfinite(values)]
    if values.size < 2:
        mean = float(values[0]) if values.size else float("nan")
        return Effect(mean, float("nan"), float("nan"), float("nan"), int(values.size))
    mean, spread = float(values.mean()), float(values.std(ddof=1))
    if spread == 0:
        return Effect(mean, mean, mean, float(np.sign(mean) * np.inf) if mean else float("nan"), int(values.size))
    low, high = intervals(values)
    return Effect(mean, float(low), float(high), mean / spread, int(values.size))


def intervals(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper ends of the bootstrap intervals of means over the last axis, the scenes.

    Percentiles, `CONFIDENCE`. Scenes are resampled, seeded: every row by the same draws.

    Parameters
    ----------
    values
        (..., scenes) float64, at least two scenes, all finite.
    """
    from scipy.stats import bootstrap

    found = bootstrap(
        (values,),
        np.mean,
        axis=-1,
        batch=_BATCH,
        confidence_level=CONFIDENCE,
        n_resamples=_RESAMPLES,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return np.asarray(found.low), np.asarray(found.high)


def median_interval(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """The median, and the order statistics around it that hold the true one with `CONFIDENCE` or more.

    Whatever the distribution, the number of values below its median is binomial.
    """
    from scipy.stats import binom

    ordered = np.sort(values)
    below = max(0, int(binom.ppf((1 - CONFIDENCE) / 2, ordered.size, 0.5)) - 1)
    return float(np.median(ordered)), float(ordered[below]), float(ordered[-1 - below])
