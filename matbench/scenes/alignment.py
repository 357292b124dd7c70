"""Where views were taken, measured from the images alone: their order, spacing and rows.

Features of the reference view are found again in every other view (SIFT, Lowe 2004; ratio test and
agreement both ways). A point moves along its row by ``-(j - r) d``; so the movements towards two
views are proportional, and their ratio tells how far apart these were taken. It must not move
across rows.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

ENOUGH = 12  # matches; with fewer nothing is said
RATIO = 0.7  # best over second-best distance
PIXELS = 1_500_000  # larger views are made smaller first
_FEATURES = 3000
_TALLEST = 0.06  # of the height: what moves further across rows is no match
_LEAST_MOVE = 0.5  # px; ratios of less are noise
_TRIM = 2.5  # deviations
_AGREE = 0.75  # px per view step, between views


@frozen(eq=False)
class Matches:
    """Points of the reference view and where another view has them.

    Parameters
    ----------
    indices
        (N,) which features of the reference view these are.
    points
        (N, 2) columns and rows there.
    across, down
        (N,) columns to the right and rows down, in pixels.
    """

    indices: NDArray[np.intp]
    points: NDArray[np.float64]
    across: NDArray[np.float64]
    down: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.indices)


def match(views: NDArray[np.uint8], ref: int) -> Mapping[int, Matches]:
    """The features of view `ref` in all others.

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
    """Pairs of descriptors that choose each other, clearly before any other."""
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
    """How the rows of a view lie against those of the reference view.

    Parameters
    ----------
    offset
        By how much its points lie lower, in their middle, px.
    worst
        The largest misalignment anywhere between the points, px: of a plane fitted to them, so that
        turned and scaled views are told from false matches.
    """

    offset: float
    worst: float


def rows(matches: Matches) -> Rows | None:
    """Vertical misalignment of a view; None with too few matches."""
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

    Only ratios can be measured: the mean step between views in their true order is 1, and the sign
    is that of the given order.

    Returns
    -------
    (count,) places, 0 for the reference view; NaN for a view with too few matches. None if nothing
    can be told.
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
    """(count, features) pixels to the right by which each feature moves towards each view; NaN where unmatched.

    A view with too few matches has none. What moves several times as far as most is taken for a
    false match: a repeated pattern.
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
    """Disparities of the matched features, pixels per view step, each once.

    Where there are three views or more, only of features on which two of them agree.

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
