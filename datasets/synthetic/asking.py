"""What was asked of a synthetic scene: its options, checked, and the cameras that see it."""

import re
from collections.abc import Iterable, Mapping
from typing import Protocol

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.datasets.synthetic.cameras import LARGEST, NAMES, Strengths
from matbench.datasets.synthetic.surfaces import Array
from matbench.errors import UserError, unknown
from matbench.scene import Range

OPTIONS = tuple(sorted((*NAMES, "baseline", "disparities", "n", "ref", "seed", "size", "views")))

WIDTH, HEIGHT, VIEWS = 240, 180, 5
"""Of a scene, where nothing else is asked for."""


class Cameras(Protocol):
    """What evenly spaced cameras see of a world."""

    def depth(self, view: int, fineness: int = 1) -> Array:
        """(H, fineness (W - 1) + 1) depth on the rays through samples 1 / fineness px apart, pixel centres included."""
        ...

    def disparity(self, depth: Array) -> Array:
        """Px per view step."""
        ...

    def visible(self, view: int, depth: Array) -> NDArray[np.bool_]:
        """(n, H, W): does view j see the point that `view` sees, at that depth, at the centre of a pixel?"""
        ...

    def picture(self, view: int, highlight: float) -> NDArray[np.float32]:
        """(H, W, 3) RGB grey levels, `highlight` of them where a surface reflects the light to the camera."""
        ...

    def pictures(self, view: int, highlight: float) -> NDArray[np.float32]:
        """(2, H, W, 3) RGB grey levels, first without the highlight and then with it (`picture`)."""
        ...


@frozen(eq=False)
class Asked:
    """A synthetic scene as it was asked for.

    Parameters
    ----------
    called
        Its name, without options.
    options
        Those that stand in brackets after it.
    n, width, height
        How many views there are, and their size in px.
    seed
        Of the cameras' faults.
    strengths
        Of the cameras' faults.
    ref
        The view to score, where the options name none.
    pair_steps
        View steps of the pair.
    disparities
        To search, px per view step.
    cameras
        What they see.
    """

    called: str
    options: Mapping[str, str]
    n: int
    width: int
    height: int
    seed: int
    strengths: Strengths
    ref: int
    pair_steps: int
    disparities: Range
    cameras: Cameras

    def partner(self, ref: int) -> int:
        """View steps to the other view of the pair: to the right where there are enough, else to the side with more."""
        right, left = min(self.pair_steps, self.n - 1 - ref), min(self.pair_steps, ref)
        return right if right >= left else -left


def check_options(called: str, options: Iterable[str], known: Iterable[str]) -> None:
    """Refuse an option that the scene does not have."""
    possible = tuple(known)
    for option in options:
        if option not in possible:
            raise unknown(f"option of {called}", option, (*possible, "predict"))


def number(called: str, options: Mapping[str, str], key: str, default: int, least: int, largest: int) -> int:
    """A whole number."""
    text = options.get(key, str(default))
    if not re.fullmatch(r"[0-9]{1,10}", text) or not least <= int(text) <= largest:
        raise UserError(f"{key}={text} of {called}: a whole number from {least} to {largest} is possible")
    return int(text)


def size(called: str, options: Mapping[str, str]) -> tuple[int, int]:
    """Width and height in px."""
    text = options.get("size", f"{WIDTH}x{HEIGHT}")
    found = re.fullmatch(r"([0-9]{1,4})x([0-9]{1,4})", text)
    width, height = (int(found[1]), int(found[2])) if found else (0, 0)
    if not (32 <= width <= 1920 and 24 <= height <= min(1440, 2 * width)):
        raise UserError(
            f"size={text} of {called}: WIDTHxHEIGHT from 32x24 to 1920x1440, no more than twice as high as wide, "
            "is possible, such as 320x240"
        )
    return width, height


def strengths(called: str, options: Mapping[str, str], default: Strengths) -> Strengths:
    """The faults of the cameras: what the options say, else the default."""
    return evolve(default, **{name: _strength(called, name, options[name]) for name in NAMES if name in options})


def _strength(called: str, name: str, text: str) -> float:
    largest = getattr(LARGEST, name)
    if not re.fullmatch(r"[0-9]{1,3}(\.[0-9]{1,6})?", text) or float(text) > largest:
        raise UserError(
            f"{name}={text} of {called}: a number from 0 to {largest:g} is possible, such as {largest / 8:g}"
        )
    return float(text)
