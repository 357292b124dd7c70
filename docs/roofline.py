"""Measure kernels beside the machine's limits, and draw ``docs/images/roofline.svg``; about a minute, on one thread.

python docs/roofline.py
"""

import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from attrs import frozen
from matplotlib.figure import Figure
from numba import njit
from numpy.typing import NDArray

from matbench.algorithms.fusion import Fusion
from matbench.algorithms.kernels import OPTIONS
from matbench.algorithms.materiality.descent import Descent
from matbench.algorithms.materiality.method import Materiality
from matbench.algorithms.materiality.start import start
from matbench.algorithms.semiglobal import SemiGlobal, aggregate
from matbench.algorithms.similarity import Form, Matcher, Matching
from matbench.bench.roofline import measure
from matbench.drawing import style
from matbench.parameters import build
from matbench.scenes.catalogue import load_scene

SCENE = "synthetic/box[size=320x240 disparities=0:59 n={}]"
PASSES, TURNS = 10, 5
_compiled = njit(**(OPTIONS | {"cache": False}))


@frozen
class Kernel:
    """What a kernel takes for each point: operations, as its equations have them, and bytes that pass through memory.

    Parameters
    ----------
    operations, bits
        How many, and on numbers of how many bits.
    """

    name: str
    seconds: float
    points: int
    operations: float
    bits: int
    bytes: float

    @property
    def nanoseconds(self) -> float:
        """Per point."""
        return self.seconds / self.points * 1e9


def best(work: Callable[[], object]) -> float:
    """The least processor time of some turns: whatever else runs only adds to it."""
    work()
    least = np.inf
    for _ in range(TURNS):
        begin = time.thread_time()
        work()
        least = min(least, time.thread_time() - begin)
    return least


@_compiled
def _add_and_bound(values, more, most, times):  # type: ignore[no-untyped-def]
    kind = values.dtype.type
    for _ in range(times):
        for i in range(values.size):
            here = values[i]
            for _k in range(16):
                here = kind(min(kind(here + more), most))
            values[i] = here


@_compiled
def _multiply_add(values, by, more, times):  # type: ignore[no-untyped-def]
    for _ in range(times):
        for i in range(values.size):
            here = values[i]
            for _k in range(8):  # a longer chain would be bound by how long one takes
                here = here * by + more
            values[i] = here


def real_numbers() -> float:
    """Thousand million float32 operations a second of multiply-adds, two each, in the first-level cache."""
    values, by, more = np.zeros(2048, np.float32), np.float32(0.5), np.float32(0.25)
    return 2 * 8 * values.size * 2000 / best(lambda: _multiply_add(values, by, more, 2000)) / 1e9


def whole_numbers(kind: type[np.uint8 | np.uint16]) -> float:
    """Thousand million additions and minima of small whole numbers a second, in the first-level cache."""
    values = np.zeros(4096, kind)
    return 2 * 16 * values.size * 500 / best(lambda: _add_and_bound(values, kind(3), kind(200), 500)) / 1e9


def energy(views: int, tied: bool) -> Kernel:
    """A pass of the energy: V of every view, residuals of consecutive pairs, A of every view, the step."""
    scene = load_scene(SCENE.format(views))
    terms = {"across": 10.0, "along": 6.0} if tied else {}
    method = build("materiality", Materiality, {"preset": "paper", "views": views, **terms})
    matcher = Matcher.of(scene, method.matching)
    rho = matcher.all()
    begin, energies = start(matcher, rho, True, 30.0), method._energy(matcher, rho, 1)
    mu, descent = np.empty_like(begin), Descent(PASSES, False, energies.safe_step)

    def work() -> None:
        np.copyto(mu, begin)
        descent.run(energies, mu)

    name = f"energy, {views} views" + (", ties" if tied else "")
    # V 2, A and its part of the slope 5 a view; residual, its square, two pulls and two slopes 10 a pair; the step 6
    operations = 7 * views + 10 * (views - 1) + 6 + 10 * tied
    # mu read, and the next one written and so read before; a byte a pair, two for the ties
    return Kernel(name, best(work), PASSES * mu.size, operations, 32, 12 + (views - 1) + 2 * tied)


def similarities(form: Form, window: int) -> Kernel:
    """Windows of consecutive pairs, in some rows of the volume."""
    settings = Matching(views=4, fineness=1, pairs="consecutive", similarity=form, window=window, truncation=0.0)
    matcher = Matcher.of(load_scene(SCENE.format(4)), settings)
    points = matcher.comparisons // matcher.space.rows * 48
    # colours 9, sums 2 times the window's side, the exponential 12; or the census's six words 7 each, division, sums
    operations, bits = (9 + 2 * window + 12, 32) if form == "ssd" else (6 * 7 + 4 + 2 * window, 8)
    return Kernel(f"{form}, {window}x{window}", best(lambda: matcher.block(96, 144)), points, operations, bits, 2)


def pixels() -> Kernel:
    """Single pixels on the rays of a view, as the default compares them."""
    matcher = Matcher.of(load_scene(SCENE.format(9)), Matching(window=1))
    features, rows = matcher.phases(), 16
    points = matcher.ray_comparisons // matcher.space.rows * rows
    # the census as above, three colours and a slope 3 each, six to weigh and to round
    return Kernel("mixed, pixels", best(lambda: matcher.rays(features, 96, 112)), points, 6 * 7 + 4 + 12 + 6, 8, 1)


def paths() -> Kernel:
    """All eight paths of the semi-global sums, the turned picture with them."""
    one = Matcher.of(load_scene(SCENE.format(5)), Matching())
    cost: NDArray[np.float32] = Fusion().first_cost(one)
    image, how = one.scene.views[one.scene.ref], SemiGlobal()
    seconds = best(lambda: aggregate(cost, image, how.small_step, how.large_step, how.contrast))
    # a path takes 9; cost to whole numbers 6 bytes, turned there and back 8, four sweeps with cost and sums 6 each
    return Kernel("paths, each", seconds, 8 * cost.size, 9, 16, (6 + 8 + 4 * 6) / 8)


def main() -> None:
    """Measure and draw."""
    limits = measure()
    speed = {32: real_numbers(), 16: whole_numbers(np.uint16), 8: whole_numbers(np.uint8)}
    kernels = [
        energy(4, tied=False), energy(9, tied=False), energy(4, tied=True), similarities("ssd", 5),
        similarities("census", 3), pixels(), paths(),
    ]  # fmt: skip
    limits = limits.best(measure())
    speed[32] = max(speed[32], real_numbers())
    print(f"memory {limits.bandwidth:.1f} GB/s;", ", ".join(f"{b} bits {s:.0f} G/s" for b, s in speed.items()))
    print("| kernel | ns a point | by arithmetic | by memory |\n|---|---|---|---|")
    for one in kernels:
        arithmetic, memory = one.operations / speed[one.bits], one.bytes / limits.bandwidth
        print(f"| {one.name} | {one.nanoseconds:.2f} | {arithmetic:.2f} | {memory:.2f} |")
    draw(kernels, speed, limits.bandwidth)


@style({"svg.fonttype": "none", "svg.hashsalt": "matbench", "font.size": 9})
def draw(kernels: list[Kernel], speed: Mapping[int, float], bandwidth: float) -> None:
    """Bars for what was measured, and for the least that arithmetic and memory allow."""
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    axes, place = figure.subplots(), np.arange(len(kernels))
    bars = {
        "measured": ([one.nanoseconds for one in kernels], "#0072b2"),
        "least by arithmetic": ([one.operations / speed[one.bits] for one in kernels], "#d55e00"),
        "least by memory": ([one.bytes / bandwidth for one in kernels], "#6a51a3"),
    }
    for number, (label, (values, colour)) in enumerate(bars.items()):
        axes.bar(place + 0.27 * (number - 1), values, 0.25, color=colour, label=label)
    axes.set_xticks(place, [one.name.replace(", ", "\n", 1) for one in kernels])
    axes.set_ylabel("ns a point")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    figure.savefig(Path(__file__).parent / "images" / "roofline.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
