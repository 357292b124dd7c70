"""Scores of a confidence map: do the pixels of which a method is sure have the smaller errors?

Pixels are taken in the order of their confidence, the surest first. The mean loss of the pixels taken so far is the
risk, and their share of all is the coverage. Only answered pixels with known truth count. The mean over all orders
stands for pixels of equal confidence, so a constant confidence is as good as none.
"""

from collections.abc import Callable
from functools import cached_property, partial
from typing import Literal

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.measures.families import Family
from matbench.measures.metrics import TIE, Errors

STEPS = 20
"""Points of a curve of risk over coverage."""

RISK = 1.0
"""Px of the pair above which an error is a loss, in the curves that every run draws."""


@frozen(eq=False)
class RankedErrors:
    """The argument of a metric of confidence: the answered pixels of a region with known truth. Read-only.

    Parameters
    ----------
    error
        (pixels,) float64 absolute errors in px of the pair.
    confidence
        (pixels,) float32 in [0, 1]; the higher, the surer.
    """

    error: Errors
    confidence: NDArray[np.float32]

    @classmethod
    def of(cls, error: Errors, confidence: NDArray[np.float32]) -> "RankedErrors":
        """Those pixels of two maps (or two lists of pixels) that have an error.

        An answer of unknown confidence has a confidence of 0.
        """
        answered = ~np.isnan(error)
        arrays = np.abs(error[answered]), np.nan_to_num(confidence[answered], nan=0.0)
        for array in arrays:
            array.setflags(write=False)
        return cls(*arrays)

    @cached_property
    def _order(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The pixels from the surest on, and where each group of equally sure ones begins."""
        order = np.argsort(-self.confidence, kind="stable")
        sure = self.confidence[order]
        return order, np.flatnonzero(np.concatenate(([True], sure[1:] != sure[:-1])))

    def risks(self, losses: NDArray[np.floating]) -> NDArray[np.float64]:
        """Mean loss of the surest pixel, of the two surest, and so on.

        Parameters
        ----------
        losses
            (pixels,) loss of each pixel, at least one.

        Returns
        -------
        (pixels,) float64; the last one is the mean loss of all.
        """
        order, begins = self._order
        counts = np.diff(np.append(begins, len(order)))
        means = np.add.reduceat(losses[order], begins, dtype=np.float64) / counts
        return _running_means(np.repeat(means, counts))

    def bad(self, threshold: float) -> NDArray[np.float64]:
        """(pixels,) loss of 100 where the error is above a threshold, in px of the pair; else 0."""
        return np.where(self.error > threshold + TIE, 100.0, 0.0)


def _running_means(values: NDArray[np.floating]) -> NDArray[np.float64]:
    means: NDArray[np.float64] = np.cumsum(values, dtype=np.float64) / np.arange(1, len(values) + 1)
    return means


def best_risks(losses: NDArray[np.floating]) -> NDArray[np.float64]:
    """The risks of an order that knows the losses, as `RankedErrors.risks`: no confidence has lower ones."""
    return _running_means(np.sort(losses))


@frozen
class ConfidenceMetric:
    """A number that says what a confidence map is worth in a region.

    Parameters
    ----------
    name, unit, better, about, always
        As for `matbench.measures.metrics.Metric`. Methods without confidence have no value.
    compute
        Function from `RankedErrors` of at least one pixel to the value; NaN if there is none. It must not write to
        its argument.
    answered_only
        True: a pixel without an answer has no place in the order.
    """

    name: str
    unit: Literal["%", "px", ""]
    better: Literal["lower", "higher"]
    about: str
    compute: Callable[[RankedErrors], float]
    answered_only: bool = True
    always: bool = True


def area(ranked: RankedErrors, threshold: float) -> float:
    """Mean over all coverages of the per cent of bad pixels among those taken.

    The area under the curve of risk over coverage; for stereo by Hu & Mordohai, "A quantitative evaluation of
    confidence measures for stereo vision", PAMI 2012; in general by Geifman & El-Yaniv, "Selective classification for
    deep neural networks", NIPS 2017. Without any order it is the per cent of all bad pixels.
    """
    return float(ranked.risks(ranked.bad(threshold)).mean())


def area_above_best(ranked: RankedErrors, threshold: float) -> float:
    """`area` less that of an order that knows which pixels are bad: what is lost by wrong confidence alone.

    For a share e of bad pixels the best area is e + (1 - e) ln(1 - e) if there are many pixels (Hu & Mordohai 2012).
    """
    losses = ranked.bad(threshold)
    return float((ranked.risks(losses) - best_risks(losses)).mean())


def sparsification_error(ranked: RankedErrors) -> float:
    """Area between the curve of the mean absolute error and its best one, over the mean absolute error of all pixels.

    AUSE as Ilg et al., "Uncertainty estimates and multi-hypotheses networks for optical flow", ECCV 2018, have it for
    endpoint errors: a share of the mean error, so methods of different accuracy can be compared. 0 is perfect.
    """
    risks = ranked.risks(ranked.error)
    if not risks[-1]:
        return 0.0  # without errors every order is perfect
    return float((risks - best_risks(ranked.error)).mean() / risks[-1])


def area_metric(threshold: float) -> ConfidenceMetric:
    """The metric ``aurc_3`` for the threshold 3, in px of the pair."""
    about = f"area under the curve of bad_{threshold:g} over coverage, the surest pixels first"
    return ConfidenceMetric(f"aurc_{threshold:g}", "%", "lower", about, partial(area, threshold=threshold))


def above_best_metric(threshold: float) -> ConfidenceMetric:
    """The metric ``ause_3`` for the threshold 3, in px of the pair."""
    about = f"aurc_{threshold:g} less the lowest that is possible for as many bad pixels"
    compute = partial(area_above_best, threshold=threshold)
    return ConfidenceMetric(f"ause_{threshold:g}", "%", "lower", about, compute)


METRICS: tuple[ConfidenceMetric | Family, ...] = (
    area_metric(RISK),
    above_best_metric(RISK),
    ConfidenceMetric(
        "ause",
        "",
        "lower",
        "area between the curve of the mean error over coverage and the best one, as a share of the mean error",
        sparsification_error,
    ),
    Family("aurc_@", "area under the curve of bad_@ over coverage", area_metric, 0.001, 1000, ("ause_@",)),
    Family("ause_@", "aurc_@ less the lowest that is possible", above_best_metric, 0.001, 1000, ("aurc_@",)),
)
"""What the confidence of a map is worth, where a method gives one."""


def sparsification(ranked: RankedErrors) -> list[tuple[float, float, float, int]]:
    """The curve of risk over coverage, at `STEPS` even coverages; empty if no pixel is answered.

    Returns
    -------
    Of each point: the coverage, in per cent of the answered pixels, the surest first; the risk, the per cent of these
    whose error is above `RISK` px; the best, the lowest such share that is possible; how many pixels they are.
    """
    count = ranked.error.size
    if not count:
        return []
    losses = ranked.bad(RISK)
    risks, best = ranked.risks(losses), best_risks(losses)
    taken = [-(-step * count // STEPS) for step in range(1, STEPS + 1)]
    return [
        (100 * step / STEPS, float(risks[pixels - 1]), float(best[pixels - 1]), pixels)
        for step, pixels in enumerate(taken, 1)
    ]
