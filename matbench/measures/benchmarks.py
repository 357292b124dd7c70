"""What the field's benchmarks report: metrics with any threshold, their own metrics, and which of them each takes.

They are computed where they are asked for: by name, by a set, or by a scene of that benchmark. Errors are in pixels
of the field's pair, as everywhere.
"""

from collections.abc import Mapping

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.ndimage import correlate, minimum_filter

from matbench.errors import unknown
from matbench.measures.families import Family
from matbench.measures.metrics import (
    TIE,
    Errors,
    MapInRegion,
    Metric,
    average,
    bad_metric,
    quantile,
    quantile_metric,
    total_bad_metric,
)

D1_PIXELS, D1_SHARE = 3.0, 0.05
"""KITTI 2015: an outlier's error is above so many pixels, and above this share of the true disparity."""

CLIP = 0.05
"""HCI: second differences count up to this, in px of the pair per px squared."""

FINE = 0.15
"""HCI: px of the pair by which fine structures must be missed to count."""


def d1(found: MapInRegion) -> float:
    """Per cent of pixels answered with an error above `D1_PIXELS` and above `D1_SHARE` of the true disparity.

    Menze & Geiger, "Object scene flow for autonomous vehicles", CVPR 2015. Ties are not bad.
    """
    return 100.0 * float(np.mean(_beyond_d1(found)[found.mask]))


def total_d1(found: MapInRegion) -> float:
    """Per cent of pixels that are outliers as in `d1`, or not answered."""
    return 100.0 * float(np.mean((_beyond_d1(found) | np.isnan(found.error))[found.mask]))


def _beyond_d1(found: MapInRegion) -> NDArray[np.bool_]:
    error = np.abs(found.error)
    allowed = D1_SHARE * np.abs(found.truth.astype(np.float64)) * found.scene.pair_steps
    beyond: NDArray[np.bool_] = error > np.maximum(D1_PIXELS, allowed) + TIE
    return beyond


def mean_square_100(errors: Errors) -> float:
    """Mean square error of answered pixels, times 100; NaN if there are none."""
    return 100.0 * average(errors**2)


def bumps(found: MapInRegion) -> NDArray[np.float64]:
    """(H, W) bumpiness of each pixel: how far the error is from running evenly.

    min(`CLIP`, ||H||), H the matrix of the second derivatives of the error, ||.|| its Frobenius norm (Honauer et
    al. 2016). A derivative is the filter of Scharr with the weights 3, 10, 3 over 16, as the benchmark's own program
    has it: for a slope of one px a pixel it is 2. NaN where not all of the 5x5 pixels around have an error.
    """
    known = np.isfinite(found.error)
    error = np.where(known, found.error, 0.0)
    first = [_slope(error, axis) for axis in (0, 1)]
    norm = np.sqrt(sum(_slope(slope, axis) ** 2 for slope in first for axis in (0, 1)))
    whole = minimum_filter(known, 5, mode="constant", cval=False)
    return np.where(whole, np.minimum(norm, CLIP), np.nan)


def _slope(values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """The filter of Scharr along an axis."""
    weights = np.outer((-1.0, 0.0, 1.0), (3.0, 10.0, 3.0)) / 16
    slope: NDArray[np.float64] = correlate(values, weights if axis == 0 else weights.T, mode="nearest")
    return slope


def bumpiness(found: MapInRegion) -> float:
    """Mean of `bumps` over the region's pixels that have one, times 100; NaN if none has."""
    inside = bumps(found)[found.mask]
    return 100.0 * average(inside)


def fattening(signed: Errors) -> float:
    """Per cent of pixels answered more than `FINE` px too near."""
    return 100.0 * float(np.mean(signed > FINE + TIE))


def thinning(signed: Errors) -> float:
    """Per cent of pixels answered more than `FINE` px too far."""
    return 100.0 * float(np.mean(signed < -FINE - TIE))


BAD = Family("bad_@", "answered, error above @ px of the pair", bad_metric, 0.001, 1000, ("total_bad_@",))
TOTAL_BAD = Family(
    "total_bad_@", "not answered, or error above @ px of the pair", total_bad_metric, 0.001, 1000, ("bad_@",)
)
QUANTILES = Family("a@", "error not exceeded by @ % of answered pixels", quantile_metric, 0.1, 100)

_D1 = f"error above {D1_PIXELS:g} px of the pair and {100 * D1_SHARE:g} % of the disparity (KITTI 2015)"

METRICS: tuple[Metric | Family, ...] = (
    BAD,
    TOTAL_BAD,
    QUANTILES,
    Metric("d1", "%", "lower", f"answered, {_D1}", d1, takes="map", always=False),
    Metric(
        "total_d1",
        "%",
        "lower",
        f"not answered, or {_D1}",
        total_d1,
        takes="map",
        answered_only=False,
        always=False,
        picture=lambda found: 100.0 * (_beyond_d1(found) | np.isnan(found.error)),
    ),
    Metric(
        "mse_100",
        "",
        "lower",
        "mean square error of answered pixels, px² of the pair, times 100 (HCI)",
        mean_square_100,
        always=False,
    ),
    Metric(
        "q25",
        "",
        "lower",
        "error not exceeded by 25 % of answered pixels, px of the pair, times 100 (HCI)",
        lambda errors: 100.0 * quantile(errors, 0.25),
        always=False,
    ),
    Metric(
        "bumpiness",
        "",
        "lower",
        "how far the error is from running evenly, times 100 (HCI, on planes and surfaces)",
        bumpiness,
        takes="map",
        picture=lambda found: 100.0 * bumps(found),
        always=False,
    ),
    Metric(
        "fattening",
        "%",
        "lower",
        f"answered, more than {FINE:g} px of the pair too near (HCI, around fine structures)",
        fattening,
        takes="signed",
        always=False,
    ),
    Metric(
        "thinning",
        "%",
        "lower",
        f"answered, more than {FINE:g} px of the pair too far (HCI, on fine structures)",
        thinning,
        takes="signed",
        always=False,
    ),
)


@frozen
class MetricSet:
    """The metrics of a benchmark.

    Parameters
    ----------
    about
        Which benchmark, and where its metrics are described.
    metrics
        Names, the one that its tables are sorted by first.
    """

    about: str
    metrics: tuple[str, ...]


_ERRORS = ("avg", "rms", "a50", "a90", "a95", "a99")

SETS: Mapping[str, MetricSet] = {
    "eth3d": MetricSet(
        "ETH3D, two views (Schöps et al. 2017)",
        ("total_bad_1", "total_bad_0.5", "total_bad_2", "total_bad_4", "invalid", *_ERRORS),
    ),
    "hci": MetricSet(
        "HCI 4D light fields (Honauer et al. 2016)",
        (
            "total_bad_0.07",
            "total_bad_0.03",
            "total_bad_0.01",
            "mse_100",
            "q25",
            "bumpiness",
            "fattening",
            "thinning",
        ),
    ),
    "kitti": MetricSet(
        "KITTI 2015 (Menze & Geiger 2015) and 2012 (Geiger, Lenz & Urtasun 2012)",
        ("total_d1", "d1", "total_bad_2", "total_bad_3", "total_bad_4", "total_bad_5", "invalid", "avg"),
    ),
    "middlebury": MetricSet(
        "Middlebury, version 3 (2014)",
        ("total_bad_2", "total_bad_0.5", "total_bad_1", "total_bad_4", "invalid", *_ERRORS),
    ),
}
"""Name -> the metrics that a benchmark reports. Missing answers count: benchmarks want whole maps, or fill them."""


def set_named(name: str) -> MetricSet:
    """The set of that name.

    Raises
    ------
    UserError
        If there is none.
    """
    if name not in SETS:
        raise unknown("metrics", name, SETS)
    return SETS[name]
