"""How large a difference between two methods is, and whether the scenes suffice to call it real."""

from collections.abc import Hashable, Sequence
from math import ceil, fsum, isfinite, sqrt

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

FEW = 6
"""With fewer scenes there is no verdict: even if all five agree in sign, chance alone does that once in 16 runs."""

ERROR = 0.05
"""How often a verdict may be wrong where there is no difference."""

CONFIDENCE = 1 - ERROR

POWER = 0.8
"""The probability with which `Effect.enough` scenes decide."""

MOST = 9999
"""More scenes than this are never proposed."""


@frozen
class Effect:
    """A mean difference over scenes.

    Parameters
    ----------
    mean
        Mean of the differences, in the metric's unit.
    low, high
        Its interval over scenes (`intervals`, `CONFIDENCE`); NaN with fewer than two.
    size
        The mean over the standard deviation of the differences (Cohen's d for paired samples);
        infinite where all scenes agree exactly, NaN with fewer than two scenes or no difference.
    scenes
        How many scenes it is over.
    p
        The smallest error rate at which an interval would leave 0 out; NaN with fewer than two scenes.
    level
        The error rate at which it is judged: `ERROR`, less beside other differences (`together`).
    """

    mean: float
    low: float
    high: float
    size: float
    scenes: int
    p: float = float("nan")
    level: float = ERROR

    @property
    def verdict(self) -> str:
        """``lower``, ``higher``, ``undecided`` where `p` reaches `level`; ``too few scenes`` below `FEW`."""
        if self.scenes < FEW:
            return "too few scenes"
        if not self.p < self.level:
            return "undecided"
        return "lower" if self.mean < 0 else "higher"

    @property
    def enough(self) -> int | None:
        """About how many scenes like these would decide, if mean and spread stayed as they are.

        So many that `POWER` of all such sets of scenes decide at `level`: ((z[1 - level/2] + z[POWER]) / size)^2 +
        z[1 - level/2]^2 / 2, rounded up (Guenther 1981, The American Statistician 35(4)). None where it is decided, for
        no difference at all, for more than `MOST`, and where skewness alone keeps so many from deciding.
        """
        from scipy.special import ndtri

        if not isfinite(self.size) or not self.size or self.verdict in ("lower", "higher"):
            return None
        tail = float(ndtri(1 - self.level / 2))
        count = max(FEW, ((tail + float(ndtri(POWER))) / self.size) ** 2 + tail**2 / 2)
        return ceil(count) if self.scenes < count <= MOST else None


def paired_effect(differences: Sequence[float]) -> Effect:
    """The effect that one difference per scene shows; NaN differences are left out.

    Scenes are the witnesses, not pixels: pixels of one scene are not independent. The same differences give
    the same interval to the last bit, in whatever order the scenes stand; taken the other way round, its negative.
    """
    return paired_effects([differences])[0]


def paired_effects(rows: Sequence[Sequence[float] | NDArray[np.float64]]) -> list[Effect]:
    """`paired_effect` of each; all are computed at once."""
    values = [np.asarray(row, np.float64) for row in rows]
    return _effects([settled(row[np.isfinite(row)]) for row in values])


def together(effects: Sequence[Effect], families: Sequence[Hashable] | None = None) -> list[Effect]:
    """Effects that are judged beside each other: the chance that any verdict is wrong is `ERROR` for all.

    The smallest of m `p` is compared with a level of `ERROR` / m, the next with the same over m - 1, and so
    on, until one is not below; the rest keep its level (Holm 1979, Scandinavian Journal of Statistics 6(2)). Effects
    over fewer than `FEW` scenes are not judged, and do not count.

    Parameters
    ----------
    families
        For each effect, which others stand beside it: those of an equal family; if not given, all.
    """
    out = list(effects)
    judged: dict[Hashable, list[int]] = {}
    for i, (effect, family) in enumerate(zip(effects, families or [None] * len(effects), strict=True)):
        if effect.scenes >= FEW:
            judged.setdefault(family, []).append(i)
    for places in judged.values():
        level, passed = 0.0, True
        for before, i in enumerate(sorted(places, key=lambda i: effects[i].p)):
            level = ERROR / (len(places) - before) if passed else level
            passed = passed and effects[i].p < level
            out[i] = evolve(effects[i], level=level)
    return out


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


def intervals(
    values: NDArray[np.float64], confidence: float = CONFIDENCE
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper ends of the intervals of means over the last axis, the scenes.

    With mean m, standard deviation s, skewness g of n scenes, and q the quantile of Student's t for n - 1 degrees of
    freedom, the wider, end by end, of two intervals::

        m -+ q s / sqrt(n)                                                        (Student 1908)
        m - T(+-q) s / sqrt(n),  T(x) = 3 sqrt(n) / g ((1 + g / sqrt(n) (x - g / (6 sqrt(n))))^(1/3) - 1)

    The second is free of the error that skewness makes (Hall 1992, Journal of the Royal Statistical Society B 54(1)):
    it covers as often as a studentised bootstrap of all resamples, but nothing is drawn. The first is the safer where
    single scenes differ much from the rest on either side. They depend neither on the order of the scenes nor on
    which of two methods is subtracted.

    Parameters
    ----------
    values
        (..., scenes) float64, at least two scenes, all finite.
    confidence
        How often they are to cover.
    """
    rows = values.reshape(-1, values.shape[-1])
    low, high = _ends(_Moments.of(list(rows)), confidence)
    shape = values.shape[:-1]
    return low.reshape(shape), high.reshape(shape)


@frozen(eq=False)
class _Moments:
    """Of each row: how many values, mean, standard deviation and skewness, all (rows,) float64.

    Sums are exact before they are rounded once, so neither order nor sign matters.
    """

    count: NDArray[np.float64]
    mean: NDArray[np.float64]
    spread: NDArray[np.float64]
    skew: NDArray[np.float64]

    @classmethod
    def of(cls, rows: Sequence[NDArray[np.float64]]) -> "_Moments":
        return cls(*np.array([_moments(row) for row in rows], np.float64).reshape(-1, 4).T)


def _moments(values: NDArray[np.float64]) -> tuple[float, float, float, float]:
    count, nothing = values.size, float("nan")
    if not count:
        return 0, nothing, nothing, nothing
    power = int(np.frexp(np.abs(values).max())[1])  # for powers that stay in range, whatever the numbers
    small = np.ldexp(values, -power)
    mean = fsum(small.tolist()) / count
    if count == 1:
        return 1, float(np.ldexp(mean, power)), nothing, nothing
    if small.min() == small.max():  # all scenes agree
        return count, float(np.ldexp(mean, power)), 0, 0
    away = small - mean
    square = fsum((away**2).tolist()) / count
    skew = fsum((away * away * away).tolist()) / count / square**1.5  # no power: it may round by sign
    return count, float(np.ldexp(mean, power)), float(np.ldexp(sqrt(square * count / (count - 1)), power)), skew


def _ends(of: _Moments, confidence: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    from scipy.special import stdtrit

    root: NDArray[np.float64] = np.sqrt(of.count)
    quantile = np.asarray(stdtrit(of.count - 1, (1 + confidence) / 2), np.float64)
    unit, tilt = of.spread / root, of.skew / root

    def back(x: NDArray[np.float64]) -> NDArray[np.float64]:
        """T(x), written so that a small skewness loses no digits."""
        moved = x - tilt / 6
        cube: NDArray[np.float64] = np.cbrt(1 + tilt * moved)
        found: NDArray[np.float64] = 3 * moved / (cube * cube + cube + 1)
        return found

    low, high = np.maximum(quantile, back(quantile)) * unit, np.minimum(-quantile, back(-quantile)) * unit
    return of.mean - low, of.mean - high


def _chances(of: _Moments) -> NDArray[np.float64]:
    """(rows,) `Effect.p`: Student's or Hall's, whichever is larger. Hall's pivot is T's inverse, a cubic in t."""
    from scipy.special import stdtr

    root = np.sqrt(of.count)
    tilt = of.skew / root
    with np.errstate(divide="ignore", invalid="ignore"):  # where all scenes agree
        t = of.mean / (of.spread / root)
        hall = t + tilt * t**2 / 3 + tilt**2 * t**3 / 27 + tilt / 6
    nearest = np.fmin(np.abs(t), np.abs(hall))
    chances = 2 * stdtr(of.count - 1, -nearest)
    alike = np.where(of.mean == 0, 1.0, 0.0)
    found: NDArray[np.float64] = np.where(of.spread == 0, alike, chances)
    return found


def _effects(rows: Sequence[NDArray[np.float64]]) -> list[Effect]:
    of = _Moments.of(rows)
    (low, high), chances = _ends(of, CONFIDENCE), _chances(of)
    with np.errstate(divide="ignore", invalid="ignore"):
        sizes = of.mean / of.spread
    numbers = (column.tolist() for column in (of.mean, low, high, sizes, of.count, chances))
    return [Effect(mean, a, b, size, int(count), p) for mean, a, b, size, count, p in zip(*numbers, strict=True)]


def median_interval(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """The median, and two values around it that enclose the true median with probability `CONFIDENCE` or more.

    This holds for any distribution, because the number of values below its median is binomial.
    """
    from scipy.stats import binom

    ordered = np.sort(values)
    below = max(0, int(binom.ppf((1 - CONFIDENCE) / 2, ordered.size, 0.5)) - 1)
    return float(np.median(ordered)), float(ordered[below]), float(ordered[-1 - below])
