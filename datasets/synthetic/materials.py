"""Pictures for surfaces: what the world's materials look like, computed.

The main one is a picture of dead leaves: discs, boxes and bands that cover one another, whose sizes r are distributed
as 1 / r^3. Such pictures have the edges, the heavy tails and the spectrum of natural images (Lee, Mumford & Huang 2001,
"Occlusion models for natural images"). Grain of several octaves, print, weave and stripes come on top.

All pictures stand in one `library`; a world takes some of them, each surface another part in another size.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.datasets.synthetic.casting import exact, inner

SIZE = 512
"""Texels that a tile is wide and high; it repeats."""
LEVELS = 9
STARTS = np.array([0, *np.cumsum([(SIZE >> level) ** 2 for level in range(LEVELS)])], np.int64)
"""Where each level of a tile begins; every level is half as wide as the one before."""
STEPS = 40
"""In which values are counted, for a deviation of 1."""


@frozen
class Material:
    """How a tile is made: the weights of its parts.

    Parameters
    ----------
    leaves, grain, print_, weave, stripes
        Weights, each of a part of deviation 1.
    least, largest
        Radii of the leaves, texels.
    rough
        Ratio of the amplitudes of one octave of the grain and the next coarser one.
    pitch
        Texels from one line of print, thread or stripe to the next.
    tint
        How much of the leaves' and grain's deviation differs from channel to channel.
    """

    leaves: float = 1.0
    grain: float = 0.2
    print_: float = 0.0
    weave: float = 0.0
    stripes: float = 0.0
    least: float = 3.0
    largest: float = 160.0
    rough: float = 0.7
    pitch: float = 16.0
    tint: float = 0.35


@inner
def _next(state):  # type: ignore[no-untyped-def]
    """A share from 0 to below 1; the state moves on (splitmix64: Steele, Lea & Flood 2014)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) / 9007199254740992.0


@inner
def _normal(state):  # type: ignore[no-untyped-def]
    """Nearly normally distributed, deviation 1."""
    return (_next(state) + _next(state) + _next(state) - 1.5) * 2.0


@exact
def _leaves(state, least, largest, tint, out):  # type: ignore[no-untyped-def]
    """Cover a tile from the front to the back."""
    size = out.shape[0]
    bare = np.ones((size, size), np.bool_)
    left = size * size
    shrink = 1 - (least / largest) ** 2
    colour = np.empty(3)
    while left > 0.02 * size * size:  # the last gaps would take as many leaves as all before
        radius = least / np.sqrt(1 - _next(state) * shrink)
        cx, cy = _next(state) * size, _next(state) * size
        shape = _next(state)
        t = 2 * _next(state) - 1
        cosine, sine = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
        slim = 0.25 + 0.75 * _next(state)
        common = _normal(state)
        for c in range(3):
            colour[c] = common + tint * _normal(state)
        fade, way = 0.5 * _normal(state) / radius, _next(state)
        reach = int(radius * 1.5) + 1
        reach = min(reach, size // 2 - 1)
        for v in range(int(cy) - reach, int(cy) + reach + 1):
            for u in range(int(cx) - reach, int(cx) + reach + 1):
                y, x = v % size, u % size
                if bare[y, x]:
                    dx, dy = u + 0.5 - cx, v + 0.5 - cy
                    a, b = cosine * dx + sine * dy, (cosine * dy - sine * dx) / slim
                    in_disc, in_box = a * a + b * b <= radius * radius, max(abs(a), abs(b)) <= radius
                    if in_disc if shape < 0.5 else in_box:
                        bare[y, x] = False
                        left -= 1
                        shade = fade * (way * a + (1 - way) * b)
                        for c in range(3):
                            out[y, x, c] = colour[c] + shade
    for y in range(size):  # a gap is filled from its left
        last = size - 1
        while last > 0 and bare[y, last]:
            last -= 1
        for x in range(size):
            if bare[y, x]:
                for c in range(3):
                    out[y, x, c] = out[y, last, c]
            else:
                last = x


@exact
def _grain(state, rough, tint, out):  # type: ignore[no-untyped-def]
    """Octaves of smoothly interpolated random grids, the finest two texels wide."""
    size = out.shape[0]
    amplitude = 1.0
    cells = 4
    while cells <= size // 2:
        grid = np.empty((cells, cells, 3))
        for j in range(cells):
            for i in range(cells):
                common = _normal(state)
                for c in range(3):
                    grid[j, i, c] = amplitude * (common + tint * _normal(state))
        step = cells / size
        for y in range(size):
            j = int(y * step)
            t = y * step - j
            t = t * t * (3 - 2 * t)
            below = (j + 1) % cells
            for x in range(size):
                i = int(x * step)
                s = x * step - i
                s = s * s * (3 - 2 * s)
                beside = (i + 1) % cells
                for c in range(3):
                    top = grid[j, i, c] * (1 - s) + grid[j, beside, c] * s
                    low = grid[below, i, c] * (1 - s) + grid[below, beside, c] * s
                    out[y, x, c] += top * (1 - t) + low * t
        amplitude *= rough
        cells *= 2


@exact
def _print(state, pitch, out):  # type: ignore[no-untyped-def]
    """Lines of print: words of upright strokes and bars, dark on bright."""
    size = out.shape[0]
    lines = max(1, int(size / pitch))
    line = size / lines
    thick = max(1.0, line / 8)
    for k in range(lines):
        top = k * line + 0.25 * line
        x = 0.0
        end = size * (0.55 + 0.45 * _next(state))
        while x < end:
            letters = 2 + int(_next(state) * 8)
            for _ in range(letters):
                high = (0.45 if _next(state) < 0.7 else 0.65) * line
                wide = line * (0.2 + 0.2 * _next(state))
                kind = _next(state)
                for v in range(int(top + 0.65 * line - high), int(top + 0.65 * line)):
                    for u in range(int(x), int(x + wide)):
                        if u >= size or v >= size:
                            continue
                        dx, dy = u - x, v - (top + 0.65 * line - high)
                        stroke = dx < thick or (kind < 0.4 and dx > wide - thick)
                        bar = (kind > 0.3 and dy < thick) or (kind > 0.6 and high - dy < 1.5 * thick)
                        if stroke or bar:
                            for c in range(3):
                                out[v, u, c] = -1.0
                x += wide + 0.12 * line
                if x >= end:
                    break
            x += 0.35 * line


@exact
def _weave(state, pitch, out):  # type: ignore[no-untyped-def]
    """Threads over and under one another: equal but for small differences from thread to thread."""
    size = out.shape[0]
    count = 2 * max(1, int(size / pitch / 2))
    warp, weft = np.empty(count), np.empty(count)
    for k in range(count):
        warp[k], weft[k] = 0.15 * _normal(state), 0.15 * _normal(state)
    for y in range(size):
        j = y * count // size
        v = 2 * (y * count / size - j) - 1
        for x in range(size):
            i = x * count // size
            u = 2 * (x * count / size - i) - 1
            over = (i + j) % 2 == 0
            value = (1 - u * u) + warp[i] if over else -(v * v) + weft[j]
            for c in range(3):
                out[y, x, c] = value


@exact
def _stripes(state, pitch, tint, out):  # type: ignore[no-untyped-def]
    """Upright stripes of several widths, whose order repeats."""
    size = out.shape[0]
    kinds = 2 + int(_next(state) * 3)
    edges, colours = np.empty(kinds + 1), np.empty((kinds, 3))
    edges[0] = 0.0
    for k in range(kinds):
        edges[k + 1] = edges[k] + 0.3 + _next(state)
        common = _normal(state)
        for c in range(3):
            colours[k, c] = common + 2 * tint * _normal(state)
    repeats = max(1, int(size / pitch / kinds))
    for x in range(size):
        place = (x * repeats / size) % 1.0 * edges[kinds]
        k = 0
        while k < kinds - 1 and place >= edges[k + 1]:
            k += 1
        for y in range(size):
            for c in range(3):
                out[y, x, c] = colours[k, c]


@exact
def _level(part, weight, total):  # type: ignore[no-untyped-def]
    """Add a part, brought to mean 0 and deviation `weight`, to a tile."""
    size = part.shape[0]
    mean, square = 0.0, 0.0
    for y in range(size):
        for x in range(size):
            for c in range(3):
                mean += part[y, x, c]
                square += part[y, x, c] * part[y, x, c]
    count = 3.0 * size * size
    mean /= count
    spread = np.sqrt(max(square / count - mean * mean, 1e-12))
    factor = weight / spread
    for y in range(size):
        for x in range(size):
            for c in range(3):
                total[y, x, c] += (part[y, x, c] - mean) * factor


@exact
def _shrink(atlas, starts, size):  # type: ignore[no-untyped-def]
    """Fill the coarser levels of a tile: means of 2 x 2 texels."""
    for level in range(1, starts.size - 1):
        wide = size >> level
        above, here = starts[level - 1], starts[level]
        for y in range(wide):
            for x in range(wide):
                first = above + 2 * y * 2 * wide + 2 * x
                for c in range(3):
                    total = atlas[first, c] + atlas[first + 1, c]
                    total += atlas[first + 2 * wide, c] + atlas[first + 2 * wide + 1, c]
                    atlas[here + y * wide + x, c] = total * np.float32(0.25)


def tile(seed: int, material: Material) -> NDArray[np.int8]:
    """(texels, 3) int8: a picture, mean 0, deviation `STEPS`, cut off at three deviations; then its coarser levels."""
    total, whole = np.zeros((SIZE, SIZE, 3)), np.zeros((SIZE, SIZE, 3))
    made = (
        (material.leaves, _leaves, (material.least, material.largest, material.tint)),
        (material.grain, _grain, (material.rough, material.tint)),
        (material.print_, _print, (material.pitch,)),
        (material.weave, _weave, (material.pitch,)),
        (material.stripes, _stripes, (material.pitch, material.tint)),
    )
    # each pattern is a kernel of its own: one kernel for all takes longer to compile
    for number, (weight, make, numbers) in enumerate(made):
        if weight:
            part = np.zeros_like(total)
            make(np.array([seed + number], np.uint64), *map(float, numbers), part)
            _level(part, float(weight), total)
    _level(total, float(STEPS), whole)
    values = np.empty((int(STARTS[-1]), 3), np.float32)
    values[: SIZE * SIZE] = np.clip(whole, -3.0 * STEPS, 3.0 * STEPS).reshape(-1, 3)
    _shrink(values, STARTS, SIZE)
    rounded: NDArray[np.int8] = np.floor(values + 0.5).astype(np.int8)
    return rounded


GRAIN = 0
"""The number of the picture that all surfaces have besides their own: hardly more than its finest octave."""

_KINDS: Mapping[str, tuple[Material, ...]] = {
    "grain": (Material(leaves=0.0, grain=1.0, rough=1.5, tint=0.3),),
    "picture": tuple(
        Material(grain=grain, least=least, largest=largest, tint=0.6)
        for grain, least, largest in (
            (0.10, 2.0, 60),
            (0.30, 2.4, 200),
            (0.50, 3.0, 90),
            (0.20, 3.6, 160),
            (0.40, 4.4, 120),
            (0.15, 5.2, 75),
            (0.25, 6.4, 180),
            (0.35, 8.0, 140),
        )
    ),
    "rough": tuple(
        Material(leaves=leaves, grain=1.0, rough=rough, least=2.0, tint=0.4)
        for leaves, rough in ((0.0, 0.55), (0.3, 0.62), (0.6, 0.7), (0.0, 0.76), (0.2, 0.83), (0.5, 0.9))
    ),
    "print": tuple(
        Material(leaves=leaves, grain=0.1, print_=1.0, pitch=pitch, tint=0.5)
        for leaves, pitch in ((0.1, 11), (0.3, 17), (0.5, 27))
    ),
    "cloth": tuple(
        Material(leaves=leaves, grain=0.3, weave=weave, pitch=pitch, tint=0.5)
        for leaves, weave, pitch in ((0.2, 0.9, 8), (0.5, 0.5, 12), (0.4, 0.7, 17), (0.8, 0.35, 23))
    ),
    "stripes": tuple(
        Material(leaves=leaves, grain=0.2, stripes=1.0, pitch=pitch, tint=0.5)
        for leaves, pitch in ((0.2, 12), (0.4, 20), (0.3, 36))
    ),
}
MATERIALS = tuple(material for kind in _KINDS.values() for material in kind)
"""Of the library, in order."""


def _numbers() -> dict[str, tuple[int, ...]]:
    found, first = {}, 0
    for kind, materials in _KINDS.items():
        found[kind] = tuple(range(first, first + len(materials)))
        first += len(materials)
    return found


NUMBERS: Mapping[str, tuple[int, ...]] = _numbers()
"""Kind -> the numbers of its pictures in the library."""

_shelf = np.zeros((len(MATERIALS), int(STARTS[-1]), 3), np.int8)
_there: set[int] = set()


def library(wanted: Iterable[int]) -> NDArray[np.int8]:
    """(pictures, texels, 3): the library, in which at least the wanted pictures are made."""
    for number in sorted(set(wanted) - _there):
        _shelf[number] = tile(number + 1, MATERIALS[number])
        _there.add(number)
    return _shelf
