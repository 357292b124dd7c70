"""Regions of the reference view, computed from images and ground truth alone.

The regions of the field's pair follow Scharstein & Szeliski 2002 and the masks of their Middlebury evaluation.
What the paper leaves open was chosen by comparison with these masks, with one rule for all scenes. Intersection
over union on Tsukuba, Venus and Teddy is 0.993, 0.920 and 0.953 for occlusions and 0.998, 0.962 and 0.943 for
discontinuities.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, uniform_filter

OCCLUSION_TOLERANCE = 1.0
"""Px of the pair. A point hides another only if it is nearer by more than this. On a slanted surface two pixels may
fall on the same column of the other view, and whole-number truth turns slants into steps of one pixel."""

JUMP, JUMP_WIDTH = 2.0, 9
"""Px of the pair: neighbours that differ by this much make a depth jump; px: width of the window around it."""

TEXTURE, TEXTURE_WIDTH = 4.0, 3
"""Grey levels: below this horizontal gradient there is no texture; px: width of the window."""

LEAST_SHARE, LEAST_PIXELS = 0.005, 100
"""Of the scene's known truth, and pixels: regions of a scene that hold less do not enter means over scenes."""

_ROUNDING = 1e-4  # px: as for the scores, float32 rounding does not decide a tie

Mask = NDArray[np.bool_]

PAIR_REGIONS = {
    "all": "truth is known",
    "nonocc": "the pair's other view sees it",
    "occ": "the pair's other view does not see it",
    "disc": "of nonocc, near a depth jump",
    "textureless": "of nonocc, hardly any horizontal gradient",
}
VIEW_REGIONS = {
    "seen_in_all": "every view sees it",
    "half_occluded": "at least one other view sees it, from at least one a nearer surface hides it",
    "out_of_frame": "at least one other view sees it, nothing hides it, some views' frames end before it",
    "seen_once": "no other view sees it",
}
REGIONS = PAIR_REGIONS | VIEW_REGIONS
"""Name -> what it holds, in one line."""


DENSE = 0.5
"""Share of the known pixels whose right neighbour is known, too, from which truth is dense."""


def is_sparse(truth: NDArray[np.float32]) -> bool:
    """Is truth known at scattered pixels, as of a laser scanner?"""
    known = np.isfinite(truth)
    pairs = np.count_nonzero(known[:, 1:] & known[:, :-1])
    return bool(truth.shape[1] > 1 and pairs < DENSE * np.count_nonzero(known[:, :-1]))


def regions(
    image: NDArray[np.uint8],
    truth: NDArray[np.float32],
    partner: float,
    seen: Mask | None = None,
    sparse: bool = False,
) -> Mapping[str, Mask]:
    """All regions of one view.

    Parameters
    ----------
    image
        (H, W, 3) uint8.
    truth
        (H, W) float32, pixels per view step, NaN where unknown.
    partner
        View steps from this view to the other one of the field's pair; negative if that is to
        the left.
    seen
        (H, W) bool, whether the partner sees the point, where that is known; by default `points_seen` decides.
    sparse
        Truth is known at scattered pixels only. Then nothing is derived from what lies beside or before a pixel:
        without `seen`, only ``all`` is known, with it all but ``disc``.

    Returns
    -------
    Name -> (H, W) bool. ``all``: truth is known. ``nonocc`` and ``occ``: of these, what the
    partner sees and what it does not. ``disc`` and ``textureless``: of ``nonocc``, what is near
    a depth jump or an occlusion, and what lacks texture.
    """
    known = np.isfinite(truth)
    if sparse and seen is None:
        return {"all": known}
    nonocc = known & (points_seen(truth, partner) if seen is None else seen)
    occ = known & ~nonocc
    jumps = {} if sparse else {"disc": nonocc & near_jumps(truth * np.float32(abs(partner)), occ)}
    return {"all": known, "nonocc": nonocc, "occ": occ, **jumps, "textureless": nonocc & textureless(image)}


def counts(pixels: int, known: int) -> bool:
    """Does a region of a scene enter the means over scenes, where it weighs as much as any other?

    A share of few pixels is noise: of one pixel it is 0 or 100 %, and below `LEAST_PIXELS` each of them is
    more than a per cent. Below `LEAST_SHARE` of the scene, what a region holds is strips and specks that hang on
    the rounding of its truth. The whole scene always counts.

    Parameters
    ----------
    pixels
        The region's, with known truth.
    known
        All of the scene's, with known truth: those of region ``all``.

    >>> counts(1, 43200), counts(215, 43200), counts(216, 43200), counts(34230, 43200)
    (False, False, True, True)
    >>> counts(60, 6912), counts(50, 50), counts(0, 0)
    (False, True, False)
    """
    return pixels > 0 and (pixels == known or pixels >= max(LEAST_PIXELS, LEAST_SHARE * known))


def points_seen(truth: NDArray[np.float32], steps: float) -> Mask:
    """Which points of the reference view are seen by a view `steps` to the right (to the left if negative).

    Every pixel is carried to the nearest column of that view; outside its frame it is not seen. Of the pixels
    that meet in one column, those no more than `OCCLUSION_TOLERANCE` behind the nearest are seen. Truth of the
    other view is not needed. Where there is one (Venus, Teddy), comparing both truths, alone or in addition,
    agreed less with the published masks.

    Parameters
    ----------
    truth
        (H, W) float32, pixels per view step, NaN where unknown.

    Returns
    -------
    (H, W) bool; False where truth is unknown.
    """
    height, width = truth.shape
    rows, columns = np.nonzero(np.isfinite(truth))
    disparity = truth[rows, columns].astype(np.float64) * abs(steps)
    target = np.floor(columns - np.sign(steps) * disparity + 0.5)
    inside = (target >= 0) & (target < width)
    rows, columns, disparity = rows[inside], columns[inside], disparity[inside]
    target = target[inside].astype(np.intp)
    front = np.full((height, width), -np.inf)
    np.maximum.at(front, (rows, target), disparity)
    seen = np.zeros((height, width), bool)
    seen[rows, columns] = disparity >= front[rows, target] - OCCLUSION_TOLERANCE - _ROUNDING
    return seen


def view_regions(
    truth: NDArray[np.float32],
    ref: int,
    count: int,
    seen: Mask | None = None,
    positions: Sequence[float] | None = None,
) -> Mapping[str, Mask]:
    """How many of the used views see a pixel's point, and why the others do not.

    Every pixel of known truth is in exactly one of the four regions. ``out_of_frame`` is the paper's
    semi-occlusion, which its frustum test finds alone. ``half_occluded`` is what its product over nearer
    points must find. In ``seen_once`` nothing can be matched. With two views only ``seen_in_all`` and
    ``seen_once`` exist.

    Parameters
    ----------
    truth
        (H, W) float32, pixels per view step, NaN where unknown.
    ref, count
        Index of the reference view, and the number of views.
    seen
        (count, H, W) bool, whether each view sees the point, where that is known exactly. By default
        `points_seen` decides. It misses occluded strips narrower than its tolerance, and points of unknown
        truth hide nothing. A point inside a view's frame that the view does not see counts as hidden.
    positions
        Where each view was taken, in view steps; by default ``0, 1, 2, ...``.

    Returns
    -------
    Name -> (H, W) bool, in the order of `VIEW_REGIONS`.
    """
    known, columns = np.isfinite(truth), np.arange(truth.shape[1])
    places = np.where(known, truth, 0).astype(np.float64)
    seen_by, hidden_from, left = (np.zeros(truth.shape, np.intp) for _ in range(3))
    for view in range(count):
        if view == ref:
            continue
        steps = view - ref if positions is None else positions[view] - positions[ref]
        place = np.floor(columns - steps * places + 0.5)
        inside = (place >= 0) & (place < truth.shape[1])
        sees = points_seen(truth, steps) if seen is None else seen[view]
        seen_by += sees
        hidden_from += inside & ~sees
        left += ~inside & ~sees
    once, hidden = seen_by == 0, hidden_from > 0
    masks = (~once & ~hidden & (left == 0), ~once & hidden, ~once & ~hidden & (left > 0), once)
    return {name: known & mask for name, mask in zip(VIEW_REGIONS, masks, strict=True)}


def seen_by(
    truth: NDArray[np.float32],
    ref: int,
    count: int,
    seen: Mask | None = None,
    positions: Sequence[float] | None = None,
) -> Mapping[str, Mask]:
    """The known pixels by how many views see their point, the reference view counted: ``seen_1``, ``seen_2`` and so on.

    ``seen_1`` is ``seen_once``, and the last one is ``seen_in_all``. No run scores them on its own. Parameters are
    those of `view_regions`.

    >>> flat = np.full((1, 8), 2, np.float32)
    >>> {name: int(mask.sum()) for name, mask in seen_by(flat, 1, 3).items()}
    {'seen_1': 0, 'seen_2': 4, 'seen_3': 4}
    """
    known, views = np.isfinite(truth), np.ones(truth.shape, np.intp)
    for view in range(count):
        if view != ref:
            steps = view - ref if positions is None else positions[view] - positions[ref]
            views += points_seen(truth, steps) if seen is None else seen[view]
    return {f"seen_{number}": known & (views == number) for number in range(1, count + 1)}


def near_jumps(disparity: NDArray[np.float32], occluded: Mask) -> Mask:
    """Pixels within a window around a depth jump or an occlusion.

    A jump is between two neighbours in a row or a column, or across a hole in the truth. Both its sides and
    the hole belong to it.

    Parameters
    ----------
    disparity
        (H, W) float32, pixels of the pair, NaN where unknown.
    occluded
        (H, W) bool. Occluded pixels lie behind a jump, even where the truth shows none.
    """
    core = occluded | _jumps_along_rows(disparity) | _jumps_along_rows(disparity.T).T
    near: Mask = maximum_filter(core, JUMP_WIDTH, mode="constant", cval=False)
    return near


def _jumps_along_rows(disparity: NDArray[np.float32]) -> Mask:
    """(H, W) bool: pixels on either side of a jump to the next known pixel in the row, and between."""
    height, width = disparity.shape
    jump = np.zeros((height, width), bool)
    rows, columns = np.nonzero(np.isfinite(disparity))
    values = disparity[rows, columns]
    gap = (rows[1:] == rows[:-1]) & (np.abs(np.diff(values)) >= JUMP - _ROUNDING)
    for row, first, last in zip(rows[:-1][gap], columns[:-1][gap], columns[1:][gap], strict=True):
        jump[row, first : last + 1] = True
    return jump


def textureless(image: NDArray[np.uint8]) -> Mask:
    """Pixels whose squared horizontal gradient, averaged over a window, is below the threshold squared.

    The gradient is a difference of neighbours in grey levels, squared, averaged over the
    channels; a pixel takes the larger of its two. (The paper does not say whether the threshold
    is squared too; its authors' program does so.)

    Parameters
    ----------
    image
        (H, W, 3) uint8.
    """
    height, width = image.shape[:2]
    steps = np.zeros((height, width + 1))
    steps[:, 1:-1] = np.mean(np.diff(image.astype(np.float64), axis=1) ** 2, axis=2)
    gradient = np.maximum(steps[:, :-1], steps[:, 1:])
    low: Mask = uniform_filter(gradient, TEXTURE_WIDTH, mode="nearest") < TEXTURE**2
    return low
