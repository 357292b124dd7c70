"""Scenes that are computed: exact truth and visibility in every view, the same on every machine.

``box``: a textured box on a floor before a wall. ``curved``: a slanted corner, balls and a column,
with disparities of either sign. ``weak``: hardly any texture, but for a few details.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench import spec
from matbench.dataset import Listing
from matbench.datasets.choose import search_range, views_and_reference
from matbench.datasets.rendering import Column, Paint, Rectangle, Rig, Sphere, Surface, Vector
from matbench.errors import UserError, unknown
from matbench.regions import regions
from matbench.scene import Range, Scene

OPTIONS = ("baseline", "disparities", "n", "noise", "ref", "seed", "size", "views")

_WIDTH, _HEIGHT, _VIEWS = 240, 180, 5
_BASELINE = 1 / 40
"""In units of the world. Disparity is 6 / Z px per step in pictures 240 px wide, whose focal length is their width."""


@frozen
class World:
    """A world before the cameras.

    Parameters
    ----------
    build
        Gives its surfaces.
    largest, offset
        The range to search is from -offset to largest - offset, px per step where pictures are
        240 px wide. It is fixed, with a margin around what there is.
    """

    build: Callable[[], Sequence[Surface]]
    largest: float
    offset: float = 0.0


def _wall(depth: float, paint: Paint) -> Rectangle:
    return Rectangle((-4 * depth, -4 * depth, depth), (8 * depth, 0, 0), (0, 8 * depth, 0), paint)


def _floor(y: float, paint: Paint) -> Rectangle:
    return Rectangle((-20, y, 0.2), (40, 0, 0), (0, 0, 20), paint)


def _block(middle: Vector, cosine: float, sine: float, size: Vector, paints: Sequence[Paint]) -> list[Surface]:
    """A box turned about its upright axis: its two near sides and its top."""
    (x, y, z), (a, b, c) = middle, size
    u, w = (a * cosine, 0.0, a * sine), (-c * sine, 0.0, c * cosine)
    top = y - b / 2
    corner = (x - (u[0] + w[0]) / 2, top, z - (u[2] + w[2]) / 2)
    down = (0.0, b, 0.0)
    return [
        Rectangle(corner, u, down, paints[0]),
        Rectangle(corner, w, down, paints[1]),
        Rectangle(corner, u, w, paints[2]),
    ]


def _box() -> Sequence[Surface]:
    sides = [Paint(colour, 30, 1.0) for colour in ((206, 96, 70), (206, 96, 70), (226, 150, 84))]
    block = _block((-0.02, 0.15, 1.42), 0.8, 0.6, (0.5, 0.5, 0.42), sides)
    return [_wall(3.2, Paint((188, 180, 160), 28, 2.2)), _floor(0.4, Paint((150, 128, 106), 26, 1.1)), *block]


def _curved() -> Sequence[Surface]:
    return [
        Rectangle((0.35, -9, 3.4), (-12, 0, -7), (0, 18, 0), Paint((128, 156, 182), 26, 2.0)),
        Rectangle((0.35, -9, 3.4), (12, 0, -9), (0, 18, 0), Paint((190, 172, 150), 26, 2.0)),
        Sphere((-0.5, 0.08, 1.5), 0.3, Paint((220, 104, 88), 30, 0.9)),
        Sphere((0.08, 0.2, 1.12), 0.17, Paint((232, 198, 92), 30, 0.7)),
        Sphere((0.15, -0.42, 2.0), 0.26, Paint((128, 184, 120), 28, 1.1)),
        Column(0.52, 1.4, 0.1, Paint((164, 142, 204), 28, 0.8)),
    ]


def _weak() -> Sequence[Surface]:
    faint = 1.2
    return [
        _wall(3.0, Paint((208, 206, 198), faint, 2.4)),
        _floor(0.5, Paint((156, 148, 138), faint, 1.6)),
        Rectangle((-1.28, -0.85, 2.95), (0.85, 0, 0), (0, 0.62, 0), Paint((132, 142, 124), 34, 1.4)),
        Rectangle((0.2, -0.4, 1.9), (0.9, 0, -0.55), (0, 0.9, 0), Paint((170, 192, 206), faint, 1.4)),
        Sphere((-0.16, 0.25, 1.3), 0.2, Paint((214, 172, 152), faint, 0.9)),
        Column(-0.4, 1.15, 0.025, Paint((98, 86, 78), 18, 0.5)),
    ]


WORLDS = {"box": World(_box, 8), "curved": World(_curved, 7, offset=2.5), "weak": World(_weak, 7)}


def _random_bytes(seed: Sequence[int], count: int) -> NDArray[np.uint8]:
    """Random bytes; raw bits of a generator, as only these are promised to stay the same."""
    words = np.random.PCG64(np.random.SeedSequence(list(seed))).random_raw(-(-count // 8))
    return np.asarray(words, "<u8").view(np.uint8)[:count]


def pattern(seed: int, size: int = 256, cells: Sequence[int] = (4, 8, 16, 32, 64)) -> NDArray[np.float32]:
    """(size, size, 3) float32, mean 0, deviation 1, periodic: random grids, smooth between, summed.

    The three channels share most of their values, so that colours are muted.
    """
    total = np.zeros((size, size, 3))
    for octave, count in enumerate(cells):
        grid = _random_bytes((seed, 1, octave), count * count * 4).reshape(count, count, 4) / 127.5 - 1
        grid = 0.6 * grid[..., :3] + grid[..., 3:]
        place = np.arange(size) * count / size
        first = place.astype(np.intp)
        t = place - first
        weight = (t * t * (3 - 2 * t))[:, None, None]
        for _ in range(2):  # down, then across
            grid = grid[first] * (1 - weight) + grid[(first + 1) % count] * weight
            grid = grid.transpose(1, 0, 2)
        total += grid
    total -= total.mean()
    relief: NDArray[np.float32] = np.clip(total / total.std(), -2.5, 2.5).astype(np.float32)
    return relief


def _noise(seed: int, view: int, shape: tuple[int, ...], deviation: float) -> NDArray[np.float64]:
    """Noise of a standard deviation in grey levels: a sum of four random bytes, near enough a Gauss curve."""
    count = int(np.prod(shape))
    sums = _random_bytes((seed, 2, view), 4 * count).reshape(4, count).sum(axis=0, dtype=np.int64)
    spread = float(np.sqrt(4 * (256**2 - 1) / 12))
    noise: NDArray[np.float64] = (sums - 510) * (deviation / spread)
    return noise.reshape(shape)


def _number(called: str, options: Mapping[str, str], key: str, default: int, least: int, largest: int) -> int:
    text = options.get(key, str(default))
    if not re.fullmatch(r"[0-9]{1,10}", text) or not least <= int(text) <= largest:
        raise UserError(f"{key}={text} of {called}: a whole number from {least} to {largest} is possible")
    return int(text)


def _read_size(called: str, text: str) -> tuple[int, int]:
    found = re.fullmatch(r"([0-9]{1,4})x([0-9]{1,4})", text)
    width, height = (int(found[1]), int(found[2])) if found else (0, 0)
    if not (32 <= width <= 1920 and 24 <= height <= min(1440, 2 * width)):
        raise UserError(
            f"size={text} of {called}: WIDTHxHEIGHT from 32x24 to 1920x1440, no more than twice as high as wide, "
            "is possible, such as 320x240"
        )
    return width, height


def _read_noise(called: str, text: str) -> float:
    if not re.fullmatch(r"[0-9]{1,2}(\.[0-9]{1,6})?", text) or float(text) > 50:
        raise UserError(f"noise={text} of {called}: grey levels from 0 to 50 are possible, such as 1.5")
    return float(text)


class Synthetic:
    """The computed scenes."""

    def listings(self, root: Path | None) -> Sequence[Listing]:  # noqa: ARG002
        """All of them; they need no data root."""
        size = {f"{_WIDTH}x{_HEIGHT}": (_WIDTH, _HEIGHT)}
        return [Listing(name, _VIEWS, size, True) for name in WORLDS]

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:  # noqa: ARG002
        """Compute a scene.

        Options: `n` views, `size` of a picture, `seed` of textures and noise, `noise` in grey
        levels (standard deviation), `views` and `baseline` to keep, `ref` to score, by number, and
        `disparities` to search.
        """
        if name not in WORLDS:
            raise unknown("scene of synthetic", name, WORLDS)
        called = f"synthetic/{name}"
        for option in options:
            if option not in OPTIONS:
                raise unknown(f"option of {called}", option, OPTIONS)
        n = _number(called, options, "n", _VIEWS, 2, 25)
        seed = _number(called, options, "seed", 0, 0, 2**31 - 1)
        width, height = _read_size(called, options.get("size", f"{_WIDTH}x{_HEIGHT}"))
        noise = _read_noise(called, options.get("noise", "1"))

        labels = [str(view) for view in range(n)]
        from_middle = sorted(range(n), key=lambda view: (abs(view - n // 2), view))
        chosen, ref = views_and_reference(called, labels, from_middle, options)
        pair_steps = max(1, n - 1 - n // 2)
        partner = pair_steps if ref + pair_steps < n else -pair_steps

        searched = search_range(called, options.get("disparities"), pair_steps)
        world, scale = WORLDS[name], width / _WIDTH
        rig = Rig(world.build(), n, width, height, width, _BASELINE, world.offset * scale)
        marks = pattern(seed)
        views = np.empty((n, height, width, 3), np.uint8)
        for view in chosen:
            grey = rig.picture(view, marks) + _noise(seed, view, views.shape[1:], noise)
            views[view] = np.clip(np.floor(grey + 0.5), 0, 255)
        truth = {view: rig.truth(view).astype(np.float32) for view in chosen}
        visible = {view: rig.visible(view) for view in chosen}
        full = Scene(
            name=spec.label(called, dict(sorted(options.items()))),
            views=views,
            labels=tuple(labels),
            ref=ref,
            disparities=searched or Range(0 - world.offset, world.largest - world.offset).scaled(scale),
            truth=truth,
            pair_steps=pair_steps,
            regions=regions(views[ref], truth[ref], partner, visible[ref][ref + partner]),
            visible=visible,
        )
        return full if len(chosen) == n else full.choose(chosen)


SYNTHETIC = Synthetic()
