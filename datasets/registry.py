"""What is known of the Middlebury scenes without their files: ``middlebury.json``.

Per set and size how files are named, what grey levels mean and where all can be had (`Layout`);
per scene and size what differs, and a digest of every file (`Facts`).
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
    """How the files of a scene are named, what its truth means, and where it can be had.

    Parameters
    ----------
    folder
        Where the scenes lie, below ``middlebury``.
    numbers
        Numbers of the views in file names, left to right.
    pair
        Numbers of the two views of the field's pair, the reference view first.
    grey
        Grey levels of truth for one pixel of the pair.
    sources
        Below the site, best first, the scene's name as ``{scene}``: zip archives of all or some of
        its files, and folders (ending in a slash) of single files.
    view, truth
        File names without extension, the view's number as ``{}``.
    alias
        What a view may be called where it is offered, if something else.
    unknown
        The grey level that means unknown; None if there is none.
    largest
        Largest disparity to search, px of the pair; None takes it from the truth.
    label
        What a view is called.
    with_truth
        Numbers of the views whose truth may exist, if not those of the pair.
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
        (width, height) in pixels, if that is known.
    truth
        Numbers of the views that have truth.
    largest
        Largest disparity to search, px of the pair.
    files
        Name -> bytes, SHA-256, and pixel digest (`images.pixel_digests`).
    """

    size: tuple[int, int] | None
    truth: tuple[int, ...]
    largest: float
    files: Mapping[str, tuple[int, str, str]]


@frozen
class Registry:
    """One year of ``middlebury.json``; `special` are scenes laid out in a way of their own."""

    layouts: Mapping[str, Layout]
    special: Mapping[str, Layout]
    scenes: Mapping[str, Mapping[str, Facts]]


@cache
def _read() -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads(REGISTRY.read_text("utf-8"))
    return found


def site() -> str:
    """The official site's URL; below it lie the folders and sources of the layouts."""
    return str(_read()["site"])


@cache
def registry(year: str) -> Registry:
    """What is known of one year's scenes."""
    return structure(_read()[year], Registry)
