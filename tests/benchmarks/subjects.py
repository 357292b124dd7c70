"""What is timed: every method and every kernel, on one thread and small scenes.

Whatever a subject needs of the methods it imports itself: the same file times another commit, in which
some of it may be missing, and that must cost no other subject. Kernels are called through the functions
that methods call them by, where there are any: these change less.
"""

from collections.abc import Callable, Mapping
from functools import cache, partial
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from inspect import signature
from typing import Any

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from matbench.algorithm import Context
from matbench.datasets.synthetic import SYNTHETIC
from matbench.scene import Scene

Work = Callable[[], object]
CONTEXT = Context(volume=False)
ROWS = 16  # of what methods do in blocks of rows: like the reference's, the arrays fit into a core's own cache


def _built_in() -> dict[str, tuple[EntryPoint, str | None]]:
    """Every built-in method, as it is and with each of its presets; none that must be told something, as a program."""
    found: dict[str, tuple[EntryPoint, str | None]] = {}
    for entry in sorted(entry_points(group="matbench.algorithms"), key=lambda one: one.name):
        if entry.dist is None or entry.dist.name != "matbench-stereo":
            continue
        try:
            cls = entry.load()
            told = any(one.default is one.empty for one in signature(cls).parameters.values())
            presets = sorted(getattr(cls, "presets", ()))
        except (Exception, SystemExit):  # another commit may lack it: its own subject fails, and says so
            told, presets = False, []
        if not told:
            found[entry.name] = entry, None
            found |= {f"{entry.name}[preset={preset}]": (entry, preset) for preset in presets}
    return found


METHODS: Mapping[str, tuple[EntryPoint, str | None]] = _built_in()
"""Name -> where it is, and its preset."""


def _of(module: str, name: str) -> Any:
    return getattr(import_module(f"matbench.algorithms.{module}"), name)


def _build() -> Any:
    """What makes a method of its class and options, wherever it lies: older code has it among the selectors."""
    try:
        return import_module("matbench.parameters").build
    except ImportError:
        return import_module("matbench.spec").build


@cache
def instance(name: str) -> Any:
    """A method of `METHODS`."""
    entry, preset = METHODS[name]
    return _build()(entry.name, entry.load(), {"preset": preset} if preset else {})


@cache
def scene(width: int = 64, height: int = 48, n: int = 3, planes: int = 12) -> Scene:
    """A small picture of the built-in box."""
    options = {"size": f"{width}x{height}", "n": str(n), "disparities": f"0:{planes - 1}"}
    return SYNTHETIC.load("box", options, None)


def method(name: str) -> Work:
    """A whole solve."""
    return partial(instance(name).solve, scene(), CONTEXT)


def _large() -> Scene:
    return scene(96, 72, 4, 24)


@cache
def _matcher(name: str = "multiview_sgm") -> Any:
    one = instance(name)
    return _of("similarity", "Matcher").of(_large(), getattr(one, "matching", one))  # in older code, itself


def _rays() -> NDArray[np.uint8]:
    rho: NDArray[np.uint8] = _matcher().rays(_matcher().phases(), 0, ROWS)
    return rho


def _maps() -> NDArray[np.float32]:
    """Planes in which rays end, anywhere."""
    space = _matcher().space
    shape = space.views, space.rows, space.width
    return np.random.default_rng(0).uniform(0, space.planes - 1, shape).astype(np.float32)


@cache
def _cost() -> NDArray[np.float32]:
    cost: NDArray[np.float32] = _of("fusion", "Fusion")().first_cost(_matcher())
    return cost


def _image() -> NDArray[np.uint8]:
    return _large().views[_large().ref]


def mixed_similarities() -> Work:
    return partial(_matcher().rays, _matcher().phases(), 0, ROWS)


def pixel_similarities() -> Work:
    return partial(_matcher().rays, _matcher().phases(), 0, ROWS, 1)


def ssd_similarities() -> Work:
    return partial(_matcher("materiality[preset=paper]").block, 0, ROWS)


def better_half() -> Work:
    matcher, rho = _matcher(), _rays()
    spans = np.stack([matcher.ray_spans(i, j) for i, j in matcher.pairs])
    low, high = spans[..., 0].copy(), spans[..., 0] + spans[..., 1]
    cost = np.empty((rho.shape[0], *rho.shape[2:]), np.float32)
    return partial(_of("fusion", "better_half"), rho, low, high, np.float32(0.7), cost)


def seen_pairs() -> Work:
    matcher, rho = _matcher(), _rays()
    space, view = matcher.space, matcher.scene.ref
    spans = np.stack([matcher.ray_spans(view, j) for j in range(space.views)])
    cost, material = np.empty((2, rho.shape[0], *rho.shape[2:]), np.float32)
    kernel, hidden = _of("fusion", "weigh_seen"), np.float32(0.7)
    return partial(kernel, rho, matcher.pairs, _maps(), view, spans, 0, space.fineness, hidden, cost, material)


def seen_pixels() -> Work:
    """What pairs that see a point cost, and the support around it."""
    return partial(_of("fusion", "Fusion")().seen_cost, _matcher(), _maps(), 1, _matcher().phases())


def support() -> Work:
    fall = np.exp(np.arange(256) / -10).astype(np.float32)
    return partial(_of("fusion", "support"), _cost(), _image(), 0, 0, fall, 1, np.empty_like(_cost()))


def semi_global() -> Work:
    return partial(_of("semiglobal", "aggregate"), _cost(), _image(), 0.2, 1.0, 25.0)


def winner() -> Work:
    return partial(_of("semiglobal", "winner"), _cost(), _cost())


def mending() -> Work:
    """One round, over true maps with noise on them."""
    truth = np.stack([_large().truth[view] for view in range(_large().n)])
    noise = np.random.default_rng(0).normal(0, 0.6, truth.shape)
    return partial(_of("mending", "mend"), (truth + noise).astype(np.float32), _large().views, 1.0, 1)


def census() -> Work:
    return partial(_of("features", "census"), _of("features", "luma")(_matcher().rows), 1)


def same_surface() -> Work:
    return partial(_of("features", "same_surface"), _matcher().rows, 1, 10.0)


def _started(name: str) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    rho = _matcher(name).all()
    return rho, _of("materiality.start", "start")(_matcher(name), rho, True, 30.0)


def passes() -> Work:
    """Ten over all points, always from the same start."""
    name = "materiality[preset=paper]"
    rho, begin = _started(name)
    apart = evolve(instance(name), counted="row")  # else one count ties all rows together
    energy, mu = apart._energy(_matcher(name), rho, 1), np.empty_like(begin)
    descent = _of("materiality.descent", "Descent")(10, False, energy.safe_step)

    def work() -> None:
        np.copyto(mu, begin)
        descent.run(energy, mu)

    return work


def tied_pass() -> Work:
    name = "materiality[preset=descent]"
    rho, mu = _started(name)
    energy = instance(name)._energy(_matcher(name), rho, 1)
    return partial(energy.step, mu, mu, 0.0, energy.safe_step, np.empty_like(mu), None, 1)


def soft_start() -> Work:
    rho, _ = _started("materiality[preset=paper]")
    return partial(_of("materiality.start", "start"), _matcher("materiality[preset=paper]"), rho, True, 30.0)


def consensus() -> Work:
    return partial(_of("materiality.consensus", "consensus"), _matcher().space, _maps())


def visible_cost() -> Work:
    matcher = _matcher("materiality[preset=paper]")
    rho, mu = _started("materiality[preset=paper]")
    kernel = _of("materiality.binarize", "visible_cost")
    return partial(kernel, mu, rho, matcher.space, matcher.pairs, matcher.scene.ref, 0.7)


def edge_weights() -> Work:
    return partial(_of("materiality.edges", "edge_weights"), _matcher().rows, _matcher().space, 10.0)


def voxel_pooling() -> Work:
    space = _of("sampling", "search_space")(_large())
    images = _of("sampling", "fine_rows")(_large().views, space.fineness)
    unmarked = np.ones((space.views, space.rows, space.samples), np.float32)
    starts = np.array([space.start(view, 3) for view in range(space.views)])
    sums = np.empty((3, space.rows, space.columns), np.float32)
    kernel = _of("voxel_coloring", "pool_rows")
    return partial(kernel, images, unmarked, starts, 1, space.fineness, sums, 0, space.rows)


@cache
def _links() -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Excess and links of a move of all views to a farther plane, from one plane everywhere."""
    lattice = _of("cuts.lattice", "Lattice")
    space = _of("sampling", "search_space")(_large())
    rng, shape = np.random.default_rng(0), (space.rows, space.views, space.planes, space.width)
    pairs = np.array([(view, view + 1) for view in range(space.views - 1)])
    down, right = (np.full((space.views, space.rows - one, space.width - 1 + one), 9, np.int32) for one in (1, 0))
    labels = np.full((space.rows, space.views, space.width), space.planes - 2, np.int32)
    excess, links = np.empty(labels.size, np.int32), np.empty((4, 20 * labels.size), np.int32)
    given = lattice(
        pairs, _of("cuts.lattice", "whole_shifts")(space, pairs), np.zeros((0, 0, 0, 0), np.int16),
        rng.integers(0, 99, shape).astype(np.int32), down, right, 1, 1.0,
    )  # fmt: skip
    count = given.link(labels, 1, excess, links)
    return excess, links[:, :count].copy()


def uniting() -> Work:
    excess, links = _links()
    return partial(_of("cuts.contraction", "unite"), *links, np.empty_like(excess))


def contraction() -> Work:
    excess, links = _links()
    kernel, room = _of("cuts.contraction", "contract"), np.empty_like(links)

    def work() -> None:
        np.copyto(room, links)
        kernel(excess, room)

    return work


def handing_on() -> Work:
    network = _of("cuts.network", "Network").of(_links()[0], *_links()[1])
    kernel, capacity, excess = _of("cuts.handing_on", "hand_on"), network.capacity.copy(), network.excess.copy()

    def work() -> None:
        np.copyto(capacity, network.capacity)
        np.copyto(excess, network.excess)
        kernel(network.start, network.head, network.sister, capacity, excess, 5)

    return work


KERNELS: Mapping[str, Callable[[], Work]] = {
    "mixed similarities": mixed_similarities,
    "pixel similarities": pixel_similarities,
    "ssd similarities": ssd_similarities,
    "better half": better_half,
    "seen pairs": seen_pairs,
    "seen pixels": seen_pixels,
    "support": support,
    "semi-global": semi_global,
    "winner": winner,
    "mending": mending,
    "census": census,
    "same surface": same_surface,
    "passes": passes,
    "tied pass": tied_pass,
    "soft start": soft_start,
    "consensus": consensus,
    "visible cost": visible_cost,
    "edge weights": edge_weights,
    "voxel pooling": voxel_pooling,
    "uniting": uniting,
    "contraction": contraction,
    "handing on": handing_on,
}
