"""A synthetic scene from its name and options."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench import spec
from matbench.datasets.choose import search_range, views_and_reference
from matbench.datasets.synthetic.cameras import LARGEST, NAMES, NOTHING, Strengths, exposed, heights
from matbench.datasets.synthetic.rendering import Rig
from matbench.datasets.synthetic.textures import pattern
from matbench.datasets.synthetic.worlds import WORLDS, World
from matbench.errors import UserError, unknown
from matbench.regions import regions
from matbench.scene import Range, Scene
from matbench.scenes.dataset import Listing
from matbench.space import DisparitySpace, Volume, surface

OPTIONS = tuple(sorted((*NAMES, "baseline", "disparities", "n", "ref", "seed", "size", "views")))

_WIDTH, _HEIGHT, _VIEWS = 240, 180, 5
_BASELINE = 1 / 40
"""In units of the world. The focal length is the width of a picture: at 240 px the disparity is 6 / Z px per step."""


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


def _read_strength(called: str, name: str, text: str) -> float:
    largest = getattr(LARGEST, name)
    if not re.fullmatch(r"[0-9]{1,3}(\.[0-9]{1,6})?", text) or float(text) > largest:
        raise UserError(
            f"{name}={text} of {called}: a number from 0 to {largest:g} is possible, such as {largest / 8:g}"
        )
    return float(text)


@frozen
class _Request:
    """The name and options of a synthetic scene, checked."""

    called: str
    world: World
    n: int
    seed: int
    width: int
    height: int
    strengths: Strengths

    @classmethod
    def read(cls, name: str, options: Mapping[str, str]) -> "_Request":
        if name not in WORLDS:
            raise unknown("scene of synthetic", name, WORLDS)
        called, world = f"synthetic/{name}", WORLDS[name]
        for option in options:
            if option not in OPTIONS:
                raise unknown(f"option of {called}", option, (*OPTIONS, "predict"))
        n = _number(called, options, "n", _VIEWS, 2, 25)
        seed = _number(called, options, "seed", 0, 0, 2**31 - 1)
        width, height = _read_size(called, options.get("size", f"{_WIDTH}x{_HEIGHT}"))
        given = {key: _read_strength(called, key, options[key]) for key in NAMES if key in options}
        return cls(called, world, n, seed, width, height, Strengths(**{**world.strengths, **given}))

    @property
    def scale(self) -> float:
        return self.width / _WIDTH

    def rig(self, highlight: float | None = None) -> Rig:
        """The cameras and their world; `highlight` replaces the strength that was asked for."""
        return Rig(
            self.world.build(),
            self.n,
            self.width,
            self.height,
            self.width,
            _BASELINE,
            self.world.offset * self.scale,
            heights(self.strengths, self.seed, self.n),
            self.strengths.highlight if highlight is None else highlight,
        )

    def disparities(self) -> Range:
        return Range(0 - self.world.offset, self.world.largest - self.world.offset).scaled(self.scale)


class Synthetic:
    """The dataset of computed scenes."""

    def listings(self, root: Path | None) -> Sequence[Listing]:  # noqa: ARG002
        """All of them; they need no data root."""
        size = {f"{_WIDTH}x{_HEIGHT}": (_WIDTH, _HEIGHT)}
        return [Listing(name, _VIEWS, size, True) for name in WORLDS]

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:  # noqa: ARG002
        """Compute a scene.

        Options are `n` (number of views), `size` of a picture, `seed` (of textures, cameras and noise),
        `views` and `baseline` (which views to keep), `ref` (the view to score, by number), `disparities`
        to search, and the faults of cameras (`cameras.Strengths`). Regions are found in pictures without
        these faults, so that they stay the same in a sweep. Only misalignment moves them with the picture.
        """
        ask = _Request.read(name, options)
        labels = [str(view) for view in range(ask.n)]
        from_middle = sorted(range(ask.n), key=lambda view: (abs(view - ask.n // 2), view))
        chosen, ref = views_and_reference(ask.called, labels, from_middle, options)
        pair_steps = max(1, ask.n - 1 - ask.n // 2)
        partner = pair_steps if ref + pair_steps < ask.n else -pair_steps

        searched = search_range(ask.called, options.get("disparities"), pair_steps)
        rig, marks = ask.rig(), pattern(ask.seed)

        reference = rig.picture(ref, marks)

        def look(view: int) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_]]:
            sharp = reference if view == ref else rig.picture(view, marks)
            picture = exposed(sharp, ask.strengths, ask.seed, view, ask.n)
            depth = rig.depth(view)
            return picture, rig.disparity(depth).astype(np.float32), rig.visible(view, depth)

        found = {view: look(view) for view in chosen}
        views = np.zeros((ask.n, ask.height, ask.width, 3), np.uint8)
        for view, (picture, _, _) in found.items():
            views[view] = picture
        _, truth, visible = found[ref]
        # regions come from this picture: the reference view without faults of the camera and without highlights
        dull = ask.rig(highlight=0).picture(ref, marks) if ask.strengths.highlight else reference
        undisturbed = exposed(dull, NOTHING, ask.seed, ref, ask.n)
        full = Scene(
            name=spec.label(ask.called, dict(sorted(options.items()))),
            views=views,
            labels=tuple(labels),
            ref=ref,
            disparities=searched or ask.disparities(),
            truth={view: truth for view, (_, truth, _) in found.items()},
            pair_steps=pair_steps,
            regions=regions(undisturbed, truth, partner, visible[ref + partner]),
            visible={view: seen for view, (_, _, seen) in found.items()},
        )
        return full if len(chosen) == ask.n else full.choose(chosen)


def materiality(name: str, options: Mapping[str, str] | None = None, fineness: int = 1) -> Volume:
    """The exact materialities of a synthetic scene: 1 on surfaces that at least one view sees, else 0.

    Parameters
    ----------
    name, options
        As for `Synthetic.load`. All n views are used; `views` and `ref` have no effect.
    fineness
        Planes per pixel of view step, samples per pixel.

    Returns
    -------
    Volume over all n views; see `matbench.space.surface`. A ray is cast for every sample; nothing is
    interpolated.
    """
    ask = _Request.read(name, options or {})
    rig = ask.rig()
    space = DisparitySpace.covering(ask.disparities(), ask.n, ask.height, ask.width, fineness)
    maps = {view: rig.disparity(rig.depth(view, fineness)).astype(np.float32) for view in range(ask.n)}
    return surface(space, maps, tuple(range(ask.n)))


SYNTHETIC = Synthetic()
