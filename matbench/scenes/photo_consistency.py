"""Does ground truth explain the images? The other views, sampled where it says, against the reference view.

For a view r with truth d, pixel x and view j, the difference is ``|I_r(x) - I_j(x - (j - r) d)|``,
averaged over the channels, in grey levels; only where j sees the point. The same is measured with
the truth shifted by whole pixels of the pair: where truth and images belong together, the truth
itself leaves the least.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.measures.warping import picture_columns, warped
from matbench.regions import points_seen
from matbench.scene import Scene

SHIFTS = (-1.0, 0.0, 1.0)  # px of the pair
LEAST_PIXELS = 100  # below, a view says nothing


@frozen
class WarpingError:
    """How far a view, or several together, differ from the reference view.

    Parameters
    ----------
    shifts
        What was added to the truth, px of the pair.
    mean, median
        Absolute difference of colours, grey levels, one for each shift.
    pixels
        How many were compared, the same for all shifts; over several views their sum.
    """

    shifts: tuple[float, ...]
    mean: tuple[float, ...]
    median: tuple[float, ...]
    pixels: int

    def at(self, shift: float) -> float:
        """The mean at that shift."""
        return self.mean[self.shifts.index(shift)]


def warping_errors(
    scene: Scene, truth: NDArray[np.float32] | None = None, shifts: Sequence[float] = SHIFTS
) -> Mapping[int, WarpingError]:
    """The differences of every other view from the reference view.

    Parameters
    ----------
    truth
        (H, W) px per view step, NaN where unknown; by default the scene's own.

    Returns
    -------
    View index -> its differences; views that share fewer than `LEAST_PIXELS` pixels are left out.
    """
    truth = scene.truth[scene.ref] if truth is None else truth
    reference = scene.views[scene.ref].astype(np.float32)
    found = {}
    for view in range(scene.n):
        steps = scene.steps(view)
        if view == scene.ref:
            continue
        moved = [truth + np.float32(shift / scene.pair_steps) for shift in shifts]
        pictures = [warped(scene.views[view], disparity, steps) for disparity in moved]
        seen = _seen(scene, truth, view) & np.all([np.isfinite(picture[..., 0]) for picture in pictures], axis=0)
        pixels = int(np.count_nonzero(seen))
        if pixels < LEAST_PIXELS:
            continue
        differences = [np.abs(picture[seen] - reference[seen]).mean(axis=1) for picture in pictures]
        found[view] = WarpingError(
            tuple(shifts),
            tuple(float(np.mean(values, dtype=np.float64)) for values in differences),
            tuple(float(np.median(values)) for values in differences),
            pixels,
        )
    return found


def left_over(scene: Scene) -> NDArray[np.float32]:
    """What warping leaves at each pixel of the reference view: the mean difference of the views that see it.

    Returns
    -------
    (H, W) float32, grey levels; NaN where truth is unknown or no other view sees the point.
    """
    truth, reference = scene.truth[scene.ref], scene.views[scene.ref].astype(np.float32)
    total, count = np.zeros(truth.shape), np.zeros(truth.shape)
    for view in range(scene.n):
        if view != scene.ref:
            difference = np.abs(warped(scene.views[view], truth, scene.steps(view)) - reference).mean(axis=2)
            seen = _seen(scene, truth, view) & np.isfinite(difference)
            total[seen] += difference[seen]
            count[seen] += 1
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).astype(np.float32)


def _seen(scene: Scene, truth: NDArray[np.float32], view: int) -> NDArray[np.bool_]:
    """(H, W): does another view see the reference view's points? Exact where that is known; no black border."""
    exact = scene.visible.get(scene.ref) if truth is scene.truth[scene.ref] else None
    seen = points_seen(truth, scene.steps(view)) if exact is None else exact[view].copy()
    first, last = picture_columns(scene.views[scene.ref])
    seen[:, :first] = seen[:, last + 1 :] = False
    return seen


def together(errors: Mapping[int, WarpingError]) -> WarpingError | None:
    """All views as one, each weighing the same; None if there is none."""
    if not errors:
        return None
    each = list(errors.values())
    mean, median = (np.mean([getattr(error, name) for error in each], axis=0) for name in ("mean", "median"))
    return WarpingError(each[0].shifts, tuple(mean.tolist()), tuple(median.tolist()), sum(e.pixels for e in each))
