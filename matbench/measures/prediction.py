"""Prediction of an end view that the method was not given: a protocol that needs no ground truth.

The estimated disparities warp the reference view to the withheld one, and the result is compared with
what the camera saw (Szeliski 1999, "Prediction error as a quality metric for motion and stereo").
There are always two numbers: how good the prediction is where there is one, and how much of the view
is predicted.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.errors import unknown
from matbench.measures.warping import carry, picture_columns
from matbench.scene import HeldOut, NotInScene, Scene

ENDS = ("left", "right")
BEST = 100.0
"""Largest PSNR that is given, in dB: without any difference it would be infinite."""

Differences = NDArray[np.float64]


@frozen
class PredictionMetric:
    """A number for a predicted view.

    Parameters
    ----------
    name, unit, better, about, answered_only
        As for `matbench.measures.metrics.Metric`; what is not predicted is not answered.
    compute
        Function from (pixels, 3) differences in grey levels, NaN where nothing is predicted, to the value;
        NaN if there is none. It must not write to its argument.
    """

    name: str
    unit: Literal["dB", "%"]
    better: Literal["lower", "higher"]
    about: str
    compute: Callable[[Differences], float]
    answered_only: bool = True


def predictable(scene: Scene) -> tuple[str, ...]:
    """The ends that `hold_out` accepts for a scene: the reference view must stay, and at least two views."""
    ends = {"left": 0, "right": scene.n - 1}
    return tuple(end for end, index in ends.items() if index != scene.ref) if scene.n > 2 else ()


def instead_of_truth(scene: Scene) -> str:
    """What a scene without ground truth needs to be scored, in words."""
    options = [f"[predict={end}]" for end in predictable(scene)]
    return f"{' or '.join(options)} after the scene" if options else "ground truth, or a third view to be predicted"


def hold_out(scene: Scene, end: str) -> Scene:
    """The scene without its leftmost or rightmost view, which becomes `Scene.held_out`.

    Raises
    ------
    UserError
        If `end` is neither ``left`` nor ``right``, if that view is the reference view, or if fewer than
        two views would be left.
    """
    if end not in ENDS:
        raise unknown(f"view to predict of {scene.name}", end, ENDS)
    index = 0 if end == "left" else scene.n - 1
    possible = predictable(scene)
    if not possible:
        raise NotInScene(f"{scene.name}: {scene.n} views; at least three are needed to predict one of them")
    if end not in possible:
        called = f"the {end} view, {scene.labels[index]}, is the reference view"
        raise NotInScene(f"{scene.name}: {called}: predict={possible[0]} is possible")
    rest = [view for view in range(scene.n) if view != index]
    held_out = HeldOut(scene.labels[index], scene.steps(index), scene.views[index])
    return evolve(scene.choose(rest), held_out=held_out)


def predict(view: NDArray[np.uint8], disparity: NDArray[np.float32], steps: float) -> NDArray[np.float64]:
    """Predict another view from one view and its disparities.

    `carry` warps the disparities to the other view. Every pixel that has a disparity there takes its
    colour from the matching place in the given view, interpolated linearly.

    Parameters
    ----------
    view
        (H, W, 3) uint8.
    disparity
        (H, W) float32 of that view, pixels per view step, NaN where unknown.
    steps
        View steps to the other view; negative if it is to the left.

    Returns
    -------
    (H, W, 3) float64 grey levels; NaN where nothing is known.
    """
    there = carry(disparity, steps)
    rows, columns = np.nonzero(np.isfinite(there))
    place = np.clip(columns + steps * there[rows, columns], 0, view.shape[1] - 1)
    # at the right edge there is no next pixel: interpolate between the last two
    left = np.minimum(place.astype(np.intp), view.shape[1] - 2)
    share = (place - left)[:, None]
    out = np.full(view.shape, np.nan)
    out[rows, columns] = view[rows, left] * (1 - share) + view[rows, left + 1] * share
    return out


def differences(scene: Scene, disparity: NDArray[np.float32]) -> Differences:
    """(pixels, 3) predicted minus seen grey levels of the held-out view; NaN where nothing is predicted.

    Its black borders are left out (`picture_columns`; 25 columns in the outermost views of Teddy).
    """
    assert scene.held_out is not None, "only for scenes that withhold a view"  # noqa: S101
    there, image = predict(scene.views[scene.ref], disparity, scene.held_out.steps), scene.held_out.image
    first, last = picture_columns(image)
    return (there - image)[:, first : last + 1].reshape(-1, 3)


def psnr(found: Differences) -> float:
    """Peak signal-to-noise ratio, 10 log10(255² / mean square), dB, over predicted pixels; NaN if there are none."""
    predicted = found[~np.isnan(found)]
    if not predicted.size:
        return float("nan")
    square = float(np.mean(predicted**2))
    return min(BEST, 10 * float(np.log10(255**2 / square))) if square else BEST


def coverage(found: Differences) -> float:
    """Per cent of the pixels that are predicted."""
    return 100 * float((~np.isnan(found[:, 0])).mean())


METRICS: tuple[PredictionMetric, ...] = (
    PredictionMetric("prediction_psnr", "dB", "higher", "withheld view against its prediction, where one is", psnr),
    PredictionMetric(
        "prediction_coverage",
        "%",
        "higher",
        "pixels of the withheld view that are predicted",
        coverage,
        answered_only=False,
    ),
)
