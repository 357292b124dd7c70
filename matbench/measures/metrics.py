"""Scores of a disparity map: shares in per cent, errors in pixels of the field's pair."""

import warnings
from collections.abc import Callable, Iterable
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
from attrs import field, frozen
from attrs.validators import in_
from numpy.typing import NDArray

from matbench.errors import failure
from matbench.scene import Scene

Errors = NDArray[np.float64]
Better = Literal["lower", "higher", "zero"]
"""Which values are better: lower ones, higher ones, or those nearer to zero."""

ENOUGH = 90.0
"""Per cent of the pixels. A method that answers less is not ranked by metrics over answered pixels: otherwise it could
win by leaving out the hard ones."""

TIE = 1e-4
"""Px. An error that is above a threshold by no more than this is a tie, and a tie is not bad."""


@frozen
class Metric:
    """A number for the pixels of a region, and a description of it.

    Parameters
    ----------
    name
        How tables and the command line call it.
    unit
        ``"%"`` of the region's pixels, ``"px"`` of the field's pair, or empty for a plain number.
    better
        Which values are better: ``"lower"``, ``"higher"``, or, for a signed number, those nearer to ``"zero"``.
    about
        A description in one line.
    compute
        Function from what `takes` names, for at least one pixel, to the value; NaN if there is none. It must not
        write to its argument.
    takes
        ``"absolute"``: (pixels,) float64 absolute errors in px of the pair, NaN where the method has no answer.
        ``"signed"``: the same with their signs, estimate less truth: positive is too near.
        ``"map"``: a `MapInRegion`, for whatever depends on where pixels lie.
    picture
        A `MapInRegion` of all pixels with known truth -> (H, W) numbers in `unit`, NaN where there is nothing to
        show: what ``matbench figure maps --metric`` draws. None if there is nothing to look at.
    answered_only
        True if only answered pixels enter, so that missing answers do not count against a method. Then a method that
        answers less than `ENOUGH` is not ranked by the metric. True by default, to be on the safe side.
    always
        Is it computed in every run? If not, only where it is asked for, by its name or by a set that has it.
    """

    name: str
    unit: Literal["%", "px", ""]
    better: Better
    about: str
    compute: Callable[[Any], float]
    takes: Literal["absolute", "signed", "map"] = field(
        default="absolute", validator=in_(("absolute", "signed", "map"))
    )
    picture: "Callable[[MapInRegion], NDArray[np.floating]] | None" = None
    answered_only: bool = True
    always: bool = True


@frozen(eq=False)
class MapInRegion:
    """The argument of a spatial metric: a whole disparity map, and the region in which it is scored. Read-only.

    Parameters
    ----------
    scene
        The scene, with views, truth and range.
    estimate
        (H, W) float32 map of the reference view, pixels per view step; NaN where the method has no answer.
    mask
        (H, W) bool: the region's pixels with known truth. What lies outside may be looked at, but does not count.
    """

    scene: Scene
    estimate: NDArray[np.float32]
    mask: NDArray[np.bool_]

    @property
    def truth(self) -> NDArray[np.float32]:
        """(H, W) float32 true map, pixels per view step; NaN where it is unknown."""
        return self.scene.truth[self.scene.ref]

    @cached_property
    def error(self) -> Errors:
        """(H, W) float64 signed errors in px of the pair, also outside of `mask`; NaN where estimate or truth is."""
        found = signed_error_map(self.estimate, self.truth, self.scene.pair_steps)
        found.setflags(write=False)
        return found


def error_map(estimate: NDArray[np.float32], truth: NDArray[np.float32], pair_steps: float) -> Errors:
    """Absolute error of every pixel.

    Parameters
    ----------
    estimate, truth
        (H, W) float32, pixels per view step; NaN or infinite where there is none.
    pair_steps
        View steps in the field's pair.

    Returns
    -------
    (H, W) float64, pixels of the pair; NaN where either is unknown.
    """
    return np.abs(signed_error_map(estimate, truth, pair_steps))


def signed_error_map(estimate: NDArray[np.float32], truth: NDArray[np.float32], pair_steps: float) -> Errors:
    """Estimate less truth, as `error_map`: positive where the estimate is too near."""
    known = np.isfinite(estimate) & np.isfinite(truth)
    error = np.full(truth.shape, np.nan)
    error[known] = (estimate[known].astype(np.float64) - truth[known].astype(np.float64)) * pair_steps
    return error


def _answered(errors: Errors) -> Errors:
    return errors[~np.isnan(errors)]


def _percent(mask: NDArray[np.bool_]) -> float:
    return 100.0 * (int(np.count_nonzero(mask)) / mask.size)


def bad(errors: Errors, threshold: float) -> float:
    """Per cent of pixels answered with an error above the threshold; ties are not bad."""
    return _percent(errors > threshold + TIE)


def total_bad(errors: Errors, threshold: float) -> float:
    """Per cent of pixels that are bad or not answered."""
    return _percent(~(errors <= threshold + TIE))


def invalid(errors: Errors) -> float:
    """Per cent of pixels not answered."""
    return _percent(np.isnan(errors))


def average(errors: Errors) -> float:
    """Mean error of answered pixels; NaN if there are none."""
    answered = _answered(errors)
    return float(answered.mean()) if answered.size else float("nan")


def root_mean_square(errors: Errors) -> float:
    """Root mean square error of answered pixels; NaN if there are none."""
    answered = _answered(errors)
    return float(np.sqrt(np.mean(answered**2))) if answered.size else float("nan")


def quantile(errors: Errors, share: float) -> float:
    """The error that `share` of the answered pixels do not exceed, linear between order statistics.

    To the last bit that of `numpy.quantile`, which takes several times as long for regions of small pictures.
    """
    answered = _answered(errors)
    if not answered.size:
        return float("nan")
    place = share * (answered.size - 1)
    below = int(place)
    above, part = min(below + 1, answered.size - 1), place - below
    ordered = np.partition(answered, (below, above))
    low, high = float(ordered[below]), float(ordered[above])
    return low + (high - low) * part if part < 0.5 else high - (high - low) * (1 - part)


def bad_metric(threshold: float) -> Metric:
    """The metric ``bad_3`` for the threshold 3, in px of the pair."""
    about = f"answered, error above {threshold:g} px of the pair"
    return Metric(f"bad_{threshold:g}", "%", "lower", about, partial(bad, threshold=threshold))


def total_bad_metric(threshold: float) -> Metric:
    """The metric ``total_bad_3`` for the threshold 3, in px of the pair."""
    about = f"not answered, or error above {threshold:g} px of the pair"
    compute = partial(total_bad, threshold=threshold)
    return Metric(f"total_bad_{threshold:g}", "%", "lower", about, compute, answered_only=False)


def quantile_metric(percent: float) -> Metric:
    """The metric ``a90`` for 90 per cent of the answered pixels."""
    about = f"error not exceeded by {percent:g} % of answered pixels"
    return Metric(f"a{percent:g}", "px", "lower", about, partial(quantile, share=percent / 100))


_THRESHOLDS = (0.5, 1, 2, 4)
_QUANTILES = (50, 90, 95, 99)

METRICS: tuple[Metric, ...] = (
    *map(bad_metric, _THRESHOLDS),
    *map(total_bad_metric, _THRESHOLDS),
    Metric("invalid", "%", "lower", "not answered", invalid, answered_only=False),
    Metric("avg", "px", "lower", "mean error of answered pixels", average),
    Metric(
        "bias",
        "px",
        "zero",
        "mean signed error of answered pixels: positive is too near",
        average,
        takes="signed",
        picture=lambda found: found.error,
    ),
    Metric("rms", "px", "lower", "root mean square error of answered pixels", root_mean_square),
    *map(quantile_metric, _QUANTILES),
)
"""What every run computes of its maps; `matbench.measures.benchmarks` has what is computed where it is asked for."""


def score(
    estimate: NDArray[np.float32],
    truth: NDArray[np.float32],
    mask: NDArray[np.bool_],
    pair_steps: float,
    metrics: Iterable[Metric] = METRICS,
    scene: Scene | None = None,
    error: Errors | None = None,
) -> dict[str, float]:
    """Every metric over one region.

    Parameters
    ----------
    estimate, truth
        (H, W) float32, pixels per view step. A NaN or infinite estimate is no answer; pixels
        without truth never count.
    mask
        (H, W) bool, the region.
    pair_steps
        View steps in the field's pair.
    scene
        What the map is of, for metrics that take a map.
    error
        `signed_error_map` of the three, if it is known: all regions have the same.

    Returns
    -------
    Name -> value, in the order of `metrics`; all NaN if no pixel of the region has truth.

    Raises
    ------
    ValueError
        If the three arrays differ in shape, or a metric takes a map and there is no scene.
    """
    if not estimate.shape == truth.shape == mask.shape:
        raise ValueError(f"estimate is {estimate.shape}, truth {truth.shape}, region {mask.shape}: they must agree")
    known = mask & np.isfinite(truth)
    signed = (signed_error_map(estimate, truth, pair_steps) if error is None else error)[known]
    given: dict[str, Any] = {"absolute": np.abs(signed), "signed": signed}
    # all metrics share these arrays: one that writes to them must fail rather than change the next one's errors
    for errors in given.values():
        errors.setflags(write=False)
    if scene is not None:
        given["map"] = map_in_region(scene, estimate, known)
    values = {}
    for metric in metrics:
        if metric.takes not in given:
            raise ValueError(f"metric {metric.name} takes a map: give its scene")
        values[metric.name] = value_of(metric, given[metric.takes], signed.size)
    return values


def map_in_region(scene: Scene, estimate: NDArray[np.float32], mask: NDArray[np.bool_]) -> MapInRegion:
    """The argument of a spatial metric. Of `mask`, the pixels with known truth are taken."""
    arrays = np.where(np.isfinite(estimate), estimate, np.float32(np.nan)), mask & np.isfinite(scene.truth[scene.ref])
    for array in arrays:
        array.setflags(write=False)
    return MapInRegion(scene, *arrays)


def value_of(metric: Any, argument: Any, pixels: int) -> float:
    """A metric's value; NaN for an empty region or a metric that fails: a faulty plug-in must not stop the others."""
    if not pixels:
        return float("nan")
    try:
        return float(metric.compute(argument))
    except Exception as error:
        warnings.warn(f"metric {metric.name} failed: {failure(error)}", stacklevel=3)
        return float("nan")
