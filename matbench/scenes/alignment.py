"""Where views were taken, measured from the images alone: their order, spacing and rows.

Features of the reference view are matched in every other view (SIFT, Lowe 2004; ratio test and
agreement both ways). From reference view r to view j, a point of disparity d moves along its row by
``-(j - r) d``. So the movements to two views are proportional, and their ratio is the ratio of the two
baselines. A point must not move across rows.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

ENOUGH = 12  # matches; with fewer, nothing is measured
RATIO = 0.7  # best over second-best distance
PIXELS = 1_500_000  # larger views are made smaller first
_FEATURES = 3000
_TALLEST = 0.06  # of the height: what moves further across rows is no match
_LEAST_MOVE = 0.5  # px; ratios of smaller movements are noise
_TRIM = 2.5  # deviations
_AGREE = 0.75  # px per view step, between views


@frozen(eq=False)
class Matches:
    """Features of the reference view, matched in one other view.

    Parameters
    ----------
    indices
        (N,) indices of the features of the reference view.
    points
        (N, 2) their columns and rows in the reference view, px.
    across, down
        (N,) how far they move to the right and down, towards the other view, px.
    """

    indices: NDArray[np.intp]
    points: NDArray[np.float64]
    across: NDArray[np.float64]
    down: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.indices)


def match(views: NDArray[np.uint8], ref: int) -> Mapping[int, Matches]:
    """Match the features of view `ref` in all other views.

    Parameters
    ----------
    views
        (n, H, W, 3).

    Returns
    -------
    View index -> matches.
    """
    import cv2

    scale = min(1.0, (PIXELS / (views.shape[1] * views.shape[2])) ** 0.5)
    finder = cv2.SIFT.create(nfeatures=_FEATURES)

    def features(view: int) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        grey = cv2.cvtColor(views[view], cv2.COLOR_RGB2GRAY)
        if scale < 1:
            grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        points, descriptors = finder.detectAndCompute(grey, None)
        if descriptors is None:
            return np.zeros((0, 2)), np.zeros((0, 128), np.float32)
        places = np.array([point.pt for point in points])
        true_scale = np.array(grey.shape[::-1]) / (views.shape[2], views.shape[1])
        return (places + 0.5) / true_scale - 0.5, descriptors

    places, descriptors = features(ref)
    found = {}
    for view in range(len(views)):
        if view != ref:
            others, theirs = features(view)
            mine, hits = _mutual(descriptors, theirs)
            moved = others[hits] - places[mine]
            near = np.abs(moved[:, 1]) <= _TALLEST * views.shape[1]
            found[view] = Matches(mine[near], places[mine][near], moved[near, 0], moved[near, 1])
    return found


def _mutual(a: NDArray[np.float32], b: NDArray[np.float32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of pairs of descriptors that are each other's best match, and clearly better than the second best."""
    if len(a) < 2 or len(b) < 2:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None] - 2 * a @ b.T
    best = squares.argmin(axis=1)
    two = np.partition(squares, 1, axis=1)[:, :2]
    clear = two[:, 0] < RATIO**2 * two[:, 1]
    mine = np.nonzero(clear & (squares.argmin(axis=0)[best] == np.arange(len(a))))[0]
    return mine, best[mine]


@frozen
class Rows:
    """Vertical misalignment of a view against the reference view.

    Parameters
    ----------
    offset
        How much lower the points of the view lie, at the middle of all matches, px.
    worst
        The largest misalignment within the area of the matches, px. It is taken from a plane fitted to
        them: so rotated or scaled views count, but single false matches do not.
    """

    offset: float
    worst: float


def rows(matches: Matches) -> Rows | None:
    """Measure the vertical misalignment of a view; None with too few matches."""
    if len(matches) < ENOUGH:
        return None
    centred = matches.points - matches.points.mean(axis=0)
    design = np.column_stack([np.ones(len(matches)), centred / np.maximum(np.abs(centred).max(axis=0), 1)])
    offset = float(np.median(matches.down))
    keep = np.abs(matches.down - offset) <= max(3.0, 5 * _deviation(matches.down))
    plane = np.array([offset, 0.0, 0.0])
    for _ in range(8):
        if keep.sum() < 2 * ENOUGH:
            return Rows(offset, abs(offset))
        plane, *_ = np.linalg.lstsq(design[keep], matches.down[keep], rcond=None)
        left = matches.down - design @ plane
        keep = np.abs(left) <= max(0.25, _TRIM * _deviation(left[keep]))
    return Rows(float(plane[0]), float(np.quantile(np.abs(design[keep] @ plane), 0.98)))


def _deviation(values: NDArray[np.float64]) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def places(matches: Mapping[int, Matches], count: int, ref: int) -> NDArray[np.float64] | None:
    """Where each view was taken, in view steps from the reference view; from the images alone.

    Only ratios of baselines can be measured. So the unit is the mean step between neighbours, and the
    sign is chosen to agree with the given order of the views.

    Returns
    -------
    (count,) places, 0 for the reference view; NaN for a view with too few matches. None if no view has
    enough.
    """
    moves = _moves(matches, count)
    known = [view for view in range(count) if np.isfinite(moves[view]).any()]
    if not known:
        return None
    base = max(known, key=lambda view: float(np.nanmedian(np.abs(moves[view]))))
    ratios = np.full(count, np.nan)
    ratios[ref], ratios[base] = 0.0, 1.0
    for view in known:
        both = np.isfinite(moves[view]) & (np.abs(moves[base]) > _LEAST_MOVE)
        if view != base and both.sum() >= ENOUGH:
            ratios[view] = _weighted_median(moves[view][both] / moves[base][both], np.abs(moves[base][both]))
    step = float(np.mean(np.diff(np.sort(ratios[np.isfinite(ratios)]))))
    agree = np.nansum(ratios * (np.arange(count) - ref))
    found: NDArray[np.float64] = ratios / (step if agree >= 0 else -step)
    return found


def _moves(matches: Mapping[int, Matches], count: int) -> NDArray[np.float64]:
    """(count, features) how far each feature moves to the right towards each view, px; NaN where unmatched.

    A view with too few matches gets no numbers. A feature that moves several times as far as most is
    taken for a false match, such as of a repeated pattern.
    """
    features = 1 + max((int(found.indices.max()) for found in matches.values() if len(found)), default=-1)
    moves = np.full((count, features), np.nan)
    for view, found in matches.items():
        if len(found) >= ENOUGH:
            near = np.abs(found.across) <= 4 * np.median(np.abs(found.across)) + 2
            moves[view, found.indices[near]] = found.across[near]
    return moves


def _weighted_median(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])


def disparities(matches: Mapping[int, Matches], steps: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Disparities of the matched features, pixels per view step; one for each feature.

    If two or more other views are usable, a feature counts only if two of them agree on its disparity.

    Parameters
    ----------
    steps
        Where each view was taken, in view steps from the reference view.
    """
    places = np.asarray(steps, float)
    usable = np.abs(places) > 0.2
    moves = _moves(matches, len(places))[usable]
    each = -moves / places[usable][:, None]
    each = each[np.isfinite(each).any(axis=1)]
    each = each[:, np.isfinite(each).any(axis=0)]
    if not each.size:
        return np.zeros(0)
    middle: NDArray[np.float64] = np.nanmedian(each, axis=0)
    if len(each) == 1:
        return middle
    agree = np.abs(each - middle) <= np.maximum(_AGREE, 0.05 * np.abs(middle))
    found: NDArray[np.float64] = middle[agree.sum(axis=0) >= 2]
    return found
