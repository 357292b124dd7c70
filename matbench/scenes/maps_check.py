"""Are ready-made maps what they are taken for? The ways in which maps are often meant otherwise are tried."""

from collections.abc import Iterator

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from matbench.files.maps import Reading
from matbench.scene import Scene
from matbench.scenes.scene_check import Observation

SCALES = (4.0, 8.0, 16.0, 64.0, 256.0, 65535.0)
"""Stored numbers of one pixel that are in use: Middlebury's PNGs, OpenCV's 16, KITTI's 256."""

CLEARLY = 0.5
"""A rival that leaves at most this share of the wrong pixels is what the map is."""

FINE = 1.0
"""Per cent of wrong pixels up to which no rival is looked for: a good map, as it is."""


def wrong(values: NDArray[np.float32], scene: Scene) -> float:
    """Per cent of the pixels that the pair sees whose disparity is missing, or more than one pixel of it off."""
    seen = scene.regions.get("nonocc", np.isfinite(scene.truth[scene.ref]))
    if not seen.any():
        seen = np.isfinite(scene.truth[scene.ref])
    error = np.abs(values - scene.truth[scene.ref] * np.float32(scene.pair_steps))[seen]
    return 100 * float(1 - np.mean(error <= 1))


def check(stored: NDArray[np.float32], scene: Scene, reading: Reading) -> Observation:
    """What a map is: good as it is taken, or clearly better when it is taken otherwise.

    Parameters
    ----------
    stored
        (H, W) numbers as they stand in the file.
    scene
        Without truth of its reference view, the map's size is all that can be looked at.
    """
    size = f"{stored.shape[1]}x{stored.shape[0]}"
    if stored.shape != (scene.height, scene.width):
        fits = stored.shape[0] <= scene.height and stored.shape[1] <= scene.width
        how = "crop=centre, if its borders were cut off evenly" if fits else "a map of the very same pixels is needed"
        return Observation(scene.name, "problem", f"{size} px, its view {scene.width}x{scene.height}: {how}")
    values = reading.disparities(stored, scene.pair_steps)
    if not np.isfinite(values).any():
        why = "NaN or infinite" if reading.unknown is None else f"NaN, infinite or the unknown={reading.unknown:g}"
        return Observation(scene.name, "problem", f"{size} px, but no pixel has a value: all are {why}")
    if scene.ref not in scene.truth:
        return Observation(scene.name, "unknown", f"{size} px, as its view; without truth, no more can be told")
    taken = wrong(values, scene)
    told = f"{taken:.1f} % of the pixels that the pair sees are wrong by more than 1 px, or missing"
    if taken <= FINE:
        return Observation(scene.name, "good", told)
    found = min(_rivals(stored, scene, reading), key=lambda rival: rival[0])
    truth = scene.truth[scene.ref] * np.float32(scene.pair_steps)
    flat = wrong(np.full_like(truth, np.nanmedian(truth)), scene)  # numbers divided by 256 are nearly that
    if found[0] <= CLEARLY * min(taken, flat):
        return Observation(scene.name, "problem", f"{told}; only {found[0]:.1f} % {found[1]}")
    least = float(np.nanmin(np.abs(values)))
    if least > scene.width:
        far = f"no pixel has a value that can be one: the smallest is {least:.3g} px, the view {scene.width} px wide"
        return Observation(scene.name, "problem", f"{told}; {far}")
    return Observation(scene.name, "note", f"{told}; no other way to take it is clearly better")


def _rivals(stored: NDArray[np.float32], scene: Scene, reading: Reading) -> Iterator[tuple[float, str]]:
    """Per cent that is wrong if the map is taken otherwise, and how."""
    for other, turned, how in _ways(stored, reading):
        yield wrong(other.disparities(turned, scene.pair_steps), scene), how
    for steps in (scene.pair_steps, -scene.pair_steps):
        view = scene.at(steps)
        if view is not None and view in scene.truth:
            there = evolve(scene, ref=view, regions={})
            how = f"against the truth of view {scene.labels[view]}: it is that view's map"
            yield wrong(reading.disparities(stored, scene.pair_steps), there), how


def _ways(stored: NDArray[np.float32], reading: Reading) -> Iterator[tuple[Reading, NDArray[np.float32], str]]:
    """How it is taken, the map, and both in words."""
    yield reading, stored[::-1], "if it is turned upside down: write its rows from top to bottom"
    yield reading, stored[:, ::-1], "if it is mirrored: write its columns from left to right"
    for sign in (1, -1):
        for unit in ("pair", "step"):
            for scale in sorted({1.0, reading.scale, *SCALES, *(1 / s for s in SCALES)}):
                other = evolve(reading, sign=sign, unit=unit, scale=scale)
                if other != reading:
                    yield other, stored, f"with {_options(other, reading)}"


def _options(other: Reading, reading: Reading) -> str:
    """The options of `maps` that make the difference."""
    said = [
        f"scale={other.scale:g}" if other.scale != reading.scale else "",
        f"sign={other.sign}" if other.sign != reading.sign else "",
        f"unit={other.unit}" if other.unit != reading.unit else "",
    ]
    return " ".join(filter(None, said))
