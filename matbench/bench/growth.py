"""How solving time grows with pixels, disparities and views, compared with the limits of the machine."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from fnmatch import fnmatchcase
from functools import cache
from typing import Any

import numpy as np
from attrs import define, evolve, field, frozen
from numpy.typing import NDArray

from matbench import parameters
from matbench.algorithm import Algorithm, Context
from matbench.bench.roofline import Roofline
from matbench.bench.roofline import measure as measure_roofline
from matbench.errors import UserError, unknown
from matbench.measures.statistics import CONFIDENCE
from matbench.plans import plugins
from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene

EVEN: Mapping[str, object] = {"views": 0, "fineness": 1}
"""Every view and whole-pixel planes, for each method that has these parameters: only the varied size changes."""

PEER = "sgbm"
"""The method that stands in every table for comparison: OpenCV's, which everybody knows."""

AXES: Mapping[str, tuple[tuple[int, int, int, int], ...]] = {
    "pixels": ((64, 48, 16, 3), (96, 72, 16, 3), (128, 96, 16, 3), (192, 144, 16, 3), (256, 192, 16, 3)),
    "disparities": ((128, 96, 8, 3), (128, 96, 16, 3), (128, 96, 32, 3), (128, 96, 64, 3)),
    "views": ((128, 96, 16, 3), (128, 96, 16, 5), (128, 96, 16, 7), (128, 96, 16, 9)),
}
"""What is varied -> (width, height, disparities, views) of each scene."""

COUNTERS = ("point_updates", "pair_similarities", "ssd_evaluations", "voxels_tested", "pixel_disparities")
"""The counter that time is divided by: the first of these that a method has."""


@define
class Point:
    """A method on one scene: the least processor time of all its solves, and its counters of work."""

    method: str
    setting: tuple[int, int, int, int]
    work: Mapping[str, int] = field(factory=dict)
    seconds: float = float("inf")
    solves: int = 0

    def along(self, axis: str) -> float:
        """The value that is varied on an axis."""
        width, height, disparities, views = self.setting
        return float({"pixels": width * height, "disparities": disparities, "views": views}[axis])

    @property
    def cells(self) -> int:
        """Pixels x disparities x pairs with the reference view; one pair for the peer."""
        width, height, disparities, views = self.setting
        return width * height * disparities * (1 if self.method == PEER else views - 1)

    @property
    def counter(self) -> tuple[str, int]:
        """Name and value of the work that its time is divided by."""
        for name in COUNTERS:
            if self.work.get(name):
                return name, self.work[name]
        return "pixel x disparity x pair", self.cells


@frozen
class Fit:
    """The exponent in time ~ value ** exponent, by least squares on the logarithms.

    Parameters
    ----------
    exponent, low, high
        The exponent and its confidence interval by Student's t.
    ideal
        The exponent of the counted work over the same scenes: that of a method whose time is its work.
    """

    method: str
    axis: str
    exponent: float
    low: float
    high: float
    ideal: float


@frozen
class Growth:
    """Everything that was measured; `left_out` says which points were not, for want of time."""

    points: tuple[Point, ...]
    fits: tuple[Fit, ...]
    roofline: Roofline
    left_out: tuple[str, ...]

    def of(self, method: str, axis: str) -> list[Point]:
        """The measured points of a curve, in order."""
        found = (self.at(method, setting) for setting in AXES[axis])
        return [point for point in found if point is not None]

    def at(self, method: str, setting: tuple[int, int, int, int]) -> Point | None:
        """A method on one scene, if it was measured."""
        return next((p for p in self.points if p.method == method and p.setting == setting), None)

    @property
    def methods(self) -> list[str]:
        return list(dict.fromkeys(point.method for point in self.points))


@cache
def methods() -> Mapping[str, Algorithm]:
    """Name -> method, `EVEN`: every built-in one, and each of its presets."""
    found: dict[str, Algorithm] = {}
    for name in plugins.built_in_algorithms():
        plugin = plugins.algorithm(name)
        known = parameters.parameters(plugin.load())
        even = {key: value for key, value in EVEN.items() if key in known}
        found[name] = plugin.make(even)
        for preset in sorted(parameters.presets_of(plugin.load())):
            found[f"{name}[preset={preset}]"] = _made(plugin, {"preset": preset}, even)
    return found


def _made(plugin: plugins.Plugin, options: Mapping[str, object], even: Mapping[str, object]) -> Algorithm:
    """With those of `even` that mean something beside `options`: others are refused."""
    for key, value in even.items():
        with suppress(UserError):
            plugin.make({**options, key: value})
            options = {**options, key: value}
    made: Algorithm = plugin.make(options)
    return made


def chosen(patterns: Sequence[str]) -> list[str]:
    """The methods that names or patterns mean; the peer is always added."""
    for pattern in patterns:
        if not any(pattern == name or fnmatchcase(name, pattern) for name in methods()):
            raise unknown("method", pattern, methods())
    wanted = [n for n in methods() if not patterns or any(n == p or fnmatchcase(n, p) for p in patterns)]
    return wanted if PEER in wanted else [*wanted, PEER]


def _scene(setting: tuple[int, int, int, int]) -> Scene:
    """The built-in box, in which a method with whole-pixel planes searches so many of them.

    The range is given in pixels of the pair, which lies more than one view step apart where there are many views.
    """
    width, height, disparities, views = setting
    pair_steps = max(1, views - 1 - views // 2)
    return load_scene(f"synthetic/box[size={width}x{height} n={views} disparities=0:{(disparities - 1) * pair_steps}]")


def measure(names: Sequence[str], seconds: float, progress: Callable[[str], None]) -> Growth:
    """Time every method on every scene, on one thread, in rounds until the time is used up.

    In the first round scenes come from the smallest to the largest; those for which no time is left are
    left out. The least time of all rounds counts, as disturbances can only add to it.

    Parameters
    ----------
    seconds
        How long to measure, compilation apart.
    """
    import cv2

    cv2.setNumThreads(1)  # the peer would else use all cores, and the others one
    settings = sorted({s for axis in AXES.values() for s in axis}, key=lambda s: s[0] * s[1] * s[2] * (s[3] - 1))
    scenes: dict[tuple[int, int, int, int], Scene] = {}
    instances = {name: methods()[name] for name in names}
    progress("compiling")
    for name in names:
        instances[name].solve(_scene((64, 24, 4, 3)), Context())
    roofline = measure_roofline()
    end = time.monotonic() + seconds  # compiling is not growth
    points: dict[tuple[str, tuple[int, int, int, int]], Point] = {}
    number, took = 0, 0.0
    while number == 0 or time.monotonic() + took < end:
        number, begin = number + 1, time.monotonic()
        for setting in settings:
            for name in names:
                point = points.setdefault((name, setting), Point(name, setting))
                if time.monotonic() > end:
                    continue  # and not break: every point must be there, if only as left out
                progress(f"round {number}: {name}, {_words(setting)}")
                if setting not in scenes:
                    scenes[setting] = _scene(setting)
                _solve(point, instances[name], scenes[setting])
        # measured again in every round: the machine's limits must come from the same minutes as the times
        roofline = roofline.best(measure_roofline(2))
        took = time.monotonic() - begin
    left_out = [_left_out(setting, [points[name, setting] for name in names]) for setting in settings]
    measured = tuple(point for point in points.values() if point.solves)
    growth = Growth(measured, (), roofline, tuple(filter(None, left_out)))
    return evolve(growth, fits=tuple(_fits(growth, names)))


def _left_out(setting: tuple[int, int, int, int], points: Sequence[Point]) -> str:
    """Which methods were not measured on a scene, in words; empty if all were."""
    missing = [point.method for point in points if not point.solves]
    return f"{_words(setting)}: {', '.join(missing)}" if missing else ""


def _words(setting: tuple[int, int, int, int]) -> str:
    width, height, disparities, views = setting
    return f"{width}x{height}, {disparities} disparities, {views} views"


def _solve(point: Point, method: Algorithm, scene: Scene) -> None:
    """Solve once; where that is short, for a hundredth of a second, as the least of several times is the steadier."""
    spent = 0.0
    while spent < 0.01:
        begin = time.thread_time()
        estimate = method.solve(scene, Context(volume=False))
        took = time.thread_time() - begin
        point.work, point.solves = dict(estimate.work), point.solves + 1
        point.seconds = min(point.seconds, took)
        spent += max(took, 1e-4)


def _fits(growth: Growth, names: Sequence[str]) -> Iterator[Fit]:
    for name in names:
        for axis in AXES:
            curve = growth.of(name, axis)
            if len(curve) > 2:  # two points fit any line: there would be no interval
                at = np.array([point.along(axis) for point in curve])
                work = np.array([float(point.counter[1]) for point in curve])
                yield Fit(
                    name, axis, *exponent(at, np.array([point.seconds for point in curve])), exponent(at, work)[0]
                )


def exponent(at: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[float, float, float]:
    """The slope of log `values` over log `at`, and its confidence interval (slope, low, high)."""
    from scipy.stats import linregress, t

    line: Any = linregress(np.log(at), np.log(values))
    reach = float(t.ppf((1 + CONFIDENCE) / 2, at.size - 2) * line.stderr)
    return float(line.slope), float(line.slope) - reach, float(line.slope) + reach
