"""What a method has returned: checked, and made the harness's own types."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from matbench.algorithm import Estimate
from matbench.errors import failure, one_line
from matbench.measures.volumes import StoredVolume, check_space
from matbench.runs.cell_files import check_confidence
from matbench.scene import Scene


def checked_maps(estimate: Any, scene: Scene) -> dict[int, NDArray[np.float32]]:
    """The disparity maps of an estimate as float32; what is masked or infinite becomes NaN: no answer.

    Raises
    ------
    TypeError, ValueError
        If the method returned anything but an `Estimate` with maps of the scene's size.
    """
    if not isinstance(estimate, Estimate):
        raise TypeError(f"solve returned {type(estimate).__name__}, not an Estimate")
    if scene.ref not in estimate.disparity:
        raise ValueError(f"the estimate has no disparity map of the reference view {scene.ref}")
    maps = {}
    for view, values in estimate.disparity.items():
        array = _numbers("map", view, values, scene)
        with np.errstate(over="ignore"):  # too large for float32 is infinite
            single = np.ma.filled(np.ma.asarray(array, np.float32), np.float32(np.nan))
        maps[int(view)] = np.where(np.isfinite(single), single, np.float32(np.nan))
    return maps


def checked_confidence(estimate: Estimate, scene: Scene) -> dict[int, NDArray[np.float32]]:
    """The confidence maps of an estimate as float32; what is masked becomes NaN: not known.

    Raises
    ------
    TypeError, ValueError
        If they are no maps of the scene's size with values in [0, 1], or that of the reference view is missing.
    """
    given = getattr(estimate, "confidence", {})
    if not isinstance(given, Mapping):
        raise TypeError(f"the confidence is {type(given).__name__}, not a map for each view")
    if given and scene.ref not in given:
        raise ValueError(f"the estimate has confidences, but none of the reference view {scene.ref}")
    maps = {}
    for view, values in given.items():
        array = _numbers("confidence", view, values, scene)
        with np.errstate(over="ignore"):  # too large for float32 is infinite
            single = np.ma.filled(np.ma.asarray(array, np.float32), np.float32(np.nan))
        check_confidence(int(view), single)
        maps[int(view)] = single
    return maps


def checked_volume(estimate: Estimate, scene: Scene) -> StoredVolume | None:
    """The estimate's volume as it is stored; None if it has none, or one that cannot be stored: the log says why."""
    if estimate.volume is None:
        return None
    try:
        volume = StoredVolume.of(estimate.volume)
        check_space(volume.space, volume.views, scene)
    except (ValueError, TypeError, AttributeError) as error:
        print(f"volume not kept: {failure(error)}")
        return None
    return volume


def device_cost(estimate: Estimate, name: str) -> float | None:
    """What the method says that it took of a device.

    Raises
    ------
    TypeError, ValueError
        If that is no number of seconds or MiB.
    """
    told = getattr(estimate, name)
    if told is None:
        return None
    if not isinstance(told, int | float | np.integer | np.floating) or isinstance(told, bool):
        raise TypeError(f"the estimate's {name} is {type(told).__name__}, not a number")
    if not (isfinite(told) and told >= 0):
        raise ValueError(f"the estimate's {name} is {told}, which no device takes")
    return float(told)


def _numbers(what: str, view: object, values: object, scene: Scene) -> NDArray[Any]:
    """(H, W) what a method gives for a view, of whatever type of numbers, with its mask if it has one."""
    if not isinstance(view, int | np.integer) or isinstance(view, bool) or not 0 <= view < scene.n:
        raise ValueError(f"the estimate has a {what} of view {view!r}, the scene has the views 0 to {scene.n - 1}")
    expected = f"{(scene.height, scene.width)} numbers"
    try:
        array = np.asanyarray(values)  # `asarray` would forget a mask
    except ValueError as error:  # rows of unlike lengths
        raise ValueError(f"the {what} of view {view} is no array of {expected}: {one_line(error)}") from None
    if array.shape != (scene.height, scene.width) or array.dtype.kind not in "fiu":
        raise ValueError(f"the {what} of view {view} is {array.shape} {array.dtype}, not {expected}")
    return array
