"""What is known of the Middlebury scenes without their files: ``middlebury.json``.

For each set and size: how files are named, what the grey levels of the truth mean, and where the files
can be downloaded (`Layout`). For each scene and size: what differs from scene to scene, and a digest of
every file (`Facts`).
"""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from attrs import field, frozen
from cattrs import structure

REGISTRY = Path(__file__).with_name("middlebury.json")
YEARS = ("2001", "2003", "2005", "2006")


@frozen
class Layout:
    """How the files of a scene are named, what its truth means, and where it can be downloaded.

    Parameters
    ----------
    folder
        Folder of the scenes, below ``middlebury`` in the data root.
    numbers
        Numbers of the views in file names, left to right.
    pair
        Numbers of the two views of the field's pair, the reference view first.
    grey
        Grey levels of the truth for one pixel of disparity between the two views of the pair.
    sources
        Paths below the site, tried in this order; ``{scene}`` stands for the scene's name. A path is a
        zip archive with all or some of the files or, if it ends in a slash, a folder of single files.
    view, truth
        File names without extension; ``{}`` stands for the view's number.
    alias
        Another file name that the site may use for a view, as in `view`; None if there is none.
    unknown
        The grey level that means unknown; None if there is none.
    largest
        Largest disparity to search, px of the pair; None: it is taken from the scene's truth.
    label
        What a view is called in tables and figures; ``{}`` stands for its number.
    with_truth
        Numbers of the views that can have truth; by default those of the pair.
    """

    folder: str
    numbers: tuple[int, ...]
    pair: tuple[int, int]
    grey: int
    sources: tuple[str, ...]
    view: str = "view{}"
    truth: str = "disp{}"
    alias: str | None = None
    unknown: int | None = 0
    largest: float | None = None
    label: str = "{}"
    with_truth: tuple[int, ...] = field()

    @with_truth.default
    def _pair_has_truth(self) -> tuple[int, ...]:
        return self.pair

    @property
    def steps(self) -> int:
        return self.pair[1] - self.pair[0]


@frozen
class Facts:
    """What the registry knows of one scene in one size.

    Parameters
    ----------
    size
        (width, height) in pixels; None if it is not known.
    truth
        Numbers of the views that have truth.
    largest
        Largest disparity to search, px of the pair.
    files
        File name -> size in bytes, SHA-256 of the file, and SHA-256 of its pixels
        (`images.pixel_digests`), which is the same for a PNG and a PPM of one picture.
    """

    size: tuple[int, int] | None
    truth: tuple[int, ...]
    largest: float
    files: Mapping[str, tuple[int, str, str]]


@frozen
class Registry:
    """One year of ``middlebury.json``.

    Parameters
    ----------
    layouts
        Size -> the layout of its scenes.
    special
        Scene -> its own layout, where it differs from that of the other scenes.
    scenes
        Scene -> size -> facts.
    """

    layouts: Mapping[str, Layout]
    special: Mapping[str, Layout]
    scenes: Mapping[str, Mapping[str, Facts]]


@cache
def _read() -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads(REGISTRY.read_text("utf-8"))
    return found


def site() -> str:
    """URL of the official site; the sources of a `Layout` are paths below it."""
    return str(_read()["site"])


@cache
def registry(year: str) -> Registry:
    """What is known of one year's scenes."""
    return structure(_read()[year], Registry)
