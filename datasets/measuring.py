"""What the images of a folder tell of themselves: which are views, in which order and where they were taken."""

from collections.abc import Mapping, Sequence
from math import ceil, floor

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.scene import Range
from matbench.scenes import alignment
from matbench.scenes.alignment import Matches

_MEASURED = 24  # at most this many views are matched; their order is measured only if there are no more
_SURE = 40  # matched features from which a range is guessed
_MARGIN = 0.5  # of the largest measured disparity: there may be few features on the nearest surface
_UNEVEN = 0.15  # of a view step
_PARTS, _NEAR = (1, 2, 3, 4), 0.02  # positions this near to such parts of a step are taken for them
_PLATEAU = 0.5  # share of neighbours of one and the same colour from which a picture is no photograph

Images = Mapping[str, NDArray[np.uint8]]


@frozen
class Measured:
    """What was measured.

    Parameters
    ----------
    names
        The views, from left to right or from top to bottom.
    disparities
        The range, px per view step, with a wide margin; None if too few features match.
    positions
        Where the views were taken, in view steps; empty for even steps.
    vertical
        Were they taken one below the other?
    remarks
        For whoever asked, one line each.
    """

    names: tuple[str, ...]
    disparities: Range | None = None
    positions: tuple[float, ...] = ()
    vertical: bool = False
    remarks: list[str] = field(factory=list)


def measure(images: Images) -> Measured:
    """Match the features of the images, which are of one size.

    Images with plateaus of one colour in which no features are found again, where they are found in others, are maps
    and no views.
    """
    names = list(images)
    vertical = _is_vertical(list(images.values()))
    turned = [np.ascontiguousarray(np.rot90(image)) if vertical else image for image in images.values()]
    remarks = ["the views were taken one below the other: vertical = true turns them"] if vertical else []
    matches, places = _placed(turned)
    if places is not None:
        strange = [k for k, place in enumerate(places) if not np.isfinite(place)]
        maps = [k for k in strange if _has_plateaus(turned[k])]
        if maps and len(names) - len(maps) >= 2:
            left = measure({name: image for k, (name, image) in enumerate(images.items()) if k not in maps})
            told = [f"left out: {names[k]}, a map: it has plateaus, and no features of the others" for k in maps]
            return Measured(left.names, left.disparities, left.positions, left.vertical, told + left.remarks)
        if strange:
            said = f"match in {', '.join(names[k] for k in strange)}: are these views of this scene?"
            return Measured(tuple(names), vertical=vertical, remarks=[*remarks, _UNORDERED + said])
    if places is None:
        return Measured(tuple(names), vertical=vertical, remarks=[*remarks, f"{_UNORDERED}match to measure it"])
    found = alignment.disparities(matches, places)
    # most disparities are positive in a scene: if they come out negative, the names run from right to left
    if len(found) and np.median(found) < 0 and np.mean(found < 0) > 0.9:
        places, found = -places, -found
    order = list(range(len(names)))
    positions: tuple[float, ...] = ()
    if len(places) == len(names):
        order = [int(index) for index in np.argsort(places, kind="stable")]
        if order != sorted(order):
            remarks.append("the views are listed as they were taken, left to right, not by their names")
        step, positions = _positions(places[order])
        found = found * step
        if positions:
            listed = ", ".join(f"{place:g}" for place in positions)
            remarks.append(f"the views were not taken at even steps: positions = [{listed}] are measured")
    return Measured(tuple(names[k] for k in order), _range(found), positions, vertical, remarks)


_UNORDERED = "the order of the views is that of their names: too few features "


def _placed(images: Sequence[NDArray[np.uint8]]) -> tuple[Mapping[int, Matches], NDArray[np.float64] | None]:
    """Matches with a view whose features are found again in most others, and where all were taken.

    The middle view is tried first: it may be the one that is no view.
    """
    count = min(len(images), _MEASURED)
    stack = np.stack(images[:count])
    best: tuple[Mapping[int, Matches], NDArray[np.float64] | None] = {}, None
    for ref in dict.fromkeys([(count - 1) // 2, 0, count - 1]):
        matches = alignment.match(stack, ref)
        places = alignment.places(matches, count, ref)
        if places is None:
            continue
        if best[1] is None or np.isfinite(places).sum() > np.isfinite(best[1]).sum():
            best = matches, places
        if 2 * np.isfinite(places).sum() > count:
            break
    return best


def _is_vertical(images: Sequence[NDArray[np.uint8]]) -> bool:
    """Do features move up or down from view to view, rather than along the rows?"""

    def moves(views: Sequence[NDArray[np.uint8]]) -> tuple[int, float, float]:
        count = min(len(views), 3)
        found = alignment.match(np.stack(views[:count]), 0).values()
        across, down = (np.abs(np.concatenate([getattr(one, name) for one in found])) for name in ("across", "down"))
        return len(down), float(np.median(across)) if len(across) else 0, float(np.median(down)) if len(down) else 0

    count, across, down = moves(images)
    if count >= alignment.ENOUGH and across >= down:
        return False
    turned, along, aside = moves([np.ascontiguousarray(np.rot90(image)) for image in images[:3]])
    return turned >= max(alignment.ENOUGH, count) and along > 2 * aside + 0.5


def _has_plateaus(image: NDArray[np.uint8]) -> bool:
    return bool(image.shape[1] > 1 and np.mean((image[:, 1:] == image[:, :-1]).all(axis=2)) > _PLATEAU)


def _positions(places: NDArray[np.float64]) -> tuple[float, tuple[float, ...]]:
    """The view step in mean steps, and the positions in it; none for even steps.

    Parameters
    ----------
    places
        Where the views were taken, in mean steps; increasing.
    """
    apart = np.diff(places)
    if np.abs(apart - 1).max() <= _UNEVEN:
        return 1.0, ()
    middle = (len(places) - 1) // 2
    step = float(apart[max(0, middle - 1) : middle + 1].min())  # from the reference view to its nearer neighbour
    found = (places - places[0]) / step
    for parts in _PARTS:
        near = np.rint(found * parts) / parts
        if np.abs(near - found).max() <= _NEAR and (np.diff(near) > 0).all():
            return step, tuple(round(float(place), 6) for place in near)
    return step, tuple(round(float(place), 3) for place in found)


def _range(found: NDArray[np.float64]) -> Range | None:
    if len(found) < _SURE:
        return None
    low, high = (float(value) for value in np.quantile(found, (0.01, 0.99)))
    margin = 2 + _MARGIN * max(-low, high)
    return Range(floor(low - margin) if low < 0 else 0, ceil(high + margin))
