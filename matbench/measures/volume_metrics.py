"""Scores of a volume along the rays of the reference view, where the truth of a ray is known.

A ray is empty in front of the true surface. What lies behind the surface is unknown and does not count.
Distances are in planes of the volume; how many planes there are is the method's choice.
"""

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
import pandas as pd
from attrs import frozen
from numpy.typing import NDArray

from matbench.measures.metrics import TIE
from matbench.measures.volumes import Rays

BINS = 10
"""How many bins divide materialities from 0 to 1, for calibration."""


@frozen
class VolumeMetric:
    """A number for the rays of a region's pixels through a volume.

    Parameters
    ----------
    name, unit, better, about
        As for `matbench.measures.metrics.Metric`; the unit is ``"%"``, or empty for a plain number.
    answered_only
        True if only rays with a material point enter (those that `told` counts).
    compute
        Function from `Rays`, at least one of them, to the value; NaN if there is none. It must not write to its
        argument.
    """

    name: str
    unit: Literal["%", ""]
    better: Literal["lower", "higher"]
    about: str
    compute: Callable[[Rays], float]
    answered_only: bool = False


def _material(rays: Rays) -> NDArray[np.bool_]:
    return rays.materiality >= 0.5


def _right_and_wrong(rays: Rays, tolerance: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(rays, planes) material points near the surface, and those where nothing is."""
    before, material = rays.before_surface, _material(rays)
    return material & (np.abs(before) <= tolerance + TIE), material & (before > tolerance + TIE)


def told(rays: Rays) -> float:
    """Per cent of the rays that answer: with a material point (1/2 or more) at most one plane behind the surface."""
    return 100 * float((_material(rays) & (rays.before_surface >= -1 - TIE)).any(axis=1).mean())


def precision(rays: Rays, tolerance: float) -> float:
    """Of the material points near or in front of the surface, the per cent that are near; NaN if there are none.

    A point is material from 1/2 on, and near within `tolerance` planes.

    After Knapitsch et al. 2017, "Tanks and temples", with planes along a ray for distances.
    """
    right, wrong = (int(points.sum()) for points in _right_and_wrong(rays, tolerance))
    return 100 * right / (right + wrong) if right + wrong else float("nan")


def recall(rays: Rays, tolerance: float) -> float:
    """Per cent of the rays that have a material point near their surface."""
    return 100 * float(_right_and_wrong(rays, tolerance)[0].any(axis=1).mean())


def f_score(rays: Rays, tolerance: float) -> float:
    """Harmonic mean of precision and recall; 0 where nothing is found."""
    right, wrong = _right_and_wrong(rays, tolerance)
    found = right.any(axis=1).mean()
    return 200 / float(1 + wrong.sum() / right.sum() + 1 / found) if found else 0.0


def outcomes(rays: Rays) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """(points,) materialities on and in front of the surface, and whether each point is in the surface's plane."""
    nearest = np.round(rays.surface)[:, None]
    plane = np.arange(rays.materiality.shape[1])
    known = plane >= nearest
    return rays.materiality[known], np.broadcast_to(plane == nearest, known.shape)[known]


def brier(rays: Rays) -> float:
    """Mean squared difference between materiality and what is there, 1 or 0 (Brier 1950)."""
    predicted, there = outcomes(rays)
    return float(np.mean((predicted - there) ** 2, dtype=np.float64)) if predicted.size else float("nan")


def reliability(rays: Rays) -> pd.DataFrame:
    """The reliability curve: how often the surface is where the materialities predict it.

    Returns
    -------
    One row for each of `BINS` equal bins that holds points. Columns: ``materiality`` (mean of its
    points), ``observed`` (share of them in which the surface is), ``points``.
    """
    predicted, there = outcomes(rays)
    # a materiality of exactly 1 belongs to the last bin
    place = np.minimum((predicted * BINS).astype(np.intp), BINS - 1)
    points = np.bincount(place, minlength=BINS)
    filled = points > 0
    sums = (np.bincount(place, values.astype(np.float64), BINS)[filled] for values in (predicted, there))
    mean, observed = (total / points[filled] for total in sums)
    return pd.DataFrame({"materiality": mean, "observed": observed, "points": points[filled]})


def calibration_error(rays: Rays) -> float:
    """Mean distance of the reliability curve from the diagonal, weighted by the points in each bin."""
    curve = reliability(rays)
    if curve.empty:
        return float("nan")
    return float(np.average((curve["materiality"] - curve["observed"]).abs(), weights=curve["points"]))


_TOLERANCES = (1, 2)

METRICS: tuple[VolumeMetric, ...] = (
    *(
        VolumeMetric(
            f"surface_{name}_{t}",
            "%",
            "higher",
            about.format("1 plane" if t == 1 else f"{t} planes"),
            partial(compute, tolerance=t),
            answered_only=compute is precision,
        )
        for t in _TOLERANCES
        for name, about, compute in (
            ("precision", "material points within {} of the surface, of those not behind it", precision),
            ("recall", "rays with a material point within {} of the surface", recall),
            ("f", "harmonic mean of the two, within {}", f_score),
        )
    ),
    VolumeMetric("brier", "", "lower", "squared error of materiality as a probability of surface", brier),
    VolumeMetric("calibration", "", "lower", "distance of the reliability curve from the diagonal", calibration_error),
)
