"""Writing a ``scene.toml`` for a folder of images. The order of the views and the range are measured if possible."""

import json
import re
from collections import Counter
from collections.abc import Sequence
from math import ceil, floor
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.datasets.folder import MOST_VIEWS, TOML
from matbench.datasets.pair import CALIBRATION
from matbench.errors import UserError
from matbench.files.images import encoding, read_rgb, read_size
from matbench.files.writing import write_text
from matbench.scene import Range
from matbench.scenes import alignment

_IMAGES = (".png", ".ppm", ".pgm")
_NOT_READ = (".bmp", ".exr", ".gif", ".jpeg", ".jpg", ".tif", ".tiff", ".webp")
_NO_VIEW = re.compile(r"disp(?!lay)|depth|truth|mask|n?o?nocc|(^|[^a-z])gt([^a-z]|$)", re.IGNORECASE)
_MEASURED = 24  # at most this many views are matched; their order is measured only if there are no more
_COLOURS = 8  # an image with no more colours is a mask
_SURE = 40  # matched features from which a range is guessed
_MARGIN = 0.5  # of the largest measured disparity: there may be few features on the nearest surface
_OUT_OF_ORDER = 0.3  # of a view step


@frozen
class Draft:
    """The file that was written, and remarks for its user.

    Parameters
    ----------
    path
        The file.
    remarks
        One line each.
    """

    path: Path
    remarks: tuple[str, ...]


def write_scene_toml(folder: Path, disparities: tuple[float, float] | None = None, replace: bool = False) -> Draft:
    """Write ``scene.toml`` for the images of a folder.

    Parameters
    ----------
    disparities
        Least and largest, pixels per view step; measured if not given.
    replace
        Write even where the folder is a scene already.

    Raises
    ------
    UserError
        If there are fewer than two images of one size, or the folder is a scene already.
    """
    if not folder.is_dir():
        raise UserError(f"folder {str(folder)!r} does not exist")
    for known in (TOML, CALIBRATION):
        if (folder / known).exists() and not replace:
            raise UserError(f"{folder} is a scene already: it holds {known}; --force writes {TOML} all the same")
    given = None if disparities is None else Range(*disparities)
    names, remarks = _views(folder)
    images = {name: read_rgb(folder / name) for name in names}
    masks = [name for name, image in images.items() if _is_mask(image)]
    if len(masks) < len(names):  # if all have few colours they are views all the same, such as random dots
        names = [name for name in names if name not in masks]
        remarks += [f"left out: {name}, a mask: it has no more than {_COLOURS} colours" for name in masks]
        _check_count(folder, names)
    order, measured, notes = _measure(names, [images[name] for name in names])
    names = [names[index] for index in order]
    chosen = given or measured or Range(0, max(1, read_size(folder / names[0])[0] // (8 * (len(names) - 1))))
    if given is None:
        guess = "measured on matched features, with a wide margin" if measured else "A GUESS: too few features match"
        notes.append(f"disparities {chosen} px per view step: {guess}; set them yourself where you know them")
    path = folder / TOML
    write_text(path, _text(names, chosen, given is not None, bool(measured), _truth(folder, names)))
    return Draft(path, (*remarks, *notes))


def natural(name: str) -> list[tuple[int, str]]:
    """A key that sorts numbers in names by their value.

    >>> sorted(["im10.png", "im9.png"], key=natural)
    ['im9.png', 'im10.png']
    """
    parts = re.split(r"([0-9]+)", name)
    return [(int(part), "") if part.isdecimal() and part.isascii() else (-1, part.lower()) for part in parts]


def _views(folder: Path) -> tuple[list[str], list[str]]:
    """Names of the images that are taken as views, and remarks on those that are not."""
    files = [path for path in folder.iterdir() if path.suffix.lower() in _IMAGES and path.is_file()]
    images = sorted((path.name for path in files if not _NO_VIEW.search(path.stem)), key=natural)
    sizes: dict[str, tuple[int, int]] = {}
    remarks = []
    for name in images:
        try:
            json.dumps(name, ensure_ascii=False).encode("utf-8")
            sizes[name] = read_size(folder / name)
        except UserError as error:
            remarks.append(f"left out: {error}")
        except UnicodeEncodeError:
            remarks.append(f"left out: {name!r}, whose name is no text")
    _check_count(folder, list(sizes))
    size = Counter(sizes.values()).most_common(1)[0][0]
    names = [name for name in sizes if sizes[name] == size]
    remarks += [f"left out: {name}, {w}x{h} px" for name, (w, h) in sizes.items() if (w, h) != size]
    if not 2 <= len(names) <= MOST_VIEWS:
        raise UserError(f"{folder} has {len(names)} images of {size[0]}x{size[1]} px: 2 to {MOST_VIEWS} can be views")
    return names, remarks


def _check_count(folder: Path, names: Sequence[str]) -> None:
    """Refuse fewer than two views."""
    if len(names) < 2:
        found = ", ".join(names) or "none"
        others = sorted({path.suffix for path in folder.iterdir() if path.suffix.lower() in _NOT_READ})
        hint = f"; {', '.join(others)} are not read: save them as PNG" if others else ""
        raise UserError(
            f"{folder} has too few images: at least two views (PNG, or binary PPM or PGM), found: {found}{hint}"
        )


def _is_mask(image: NDArray[np.uint8]) -> bool:
    """Has an image hardly any colours?"""
    for part in (image[::16], image):  # of a photograph, a few rows tell
        packed = part.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
        if len(np.unique(packed)) > _COLOURS:
            return False
    return True


def _measure(names: Sequence[str], images: Sequence[NDArray[np.uint8]]) -> tuple[list[int], Range | None, list[str]]:
    """Indices of the views from left to right, the range of disparities (None if unknown), and remarks."""
    count, ref = min(len(images), _MEASURED), (min(len(images), _MEASURED) - 1) // 2
    matches = alignment.match(np.stack(images[:count]), ref)
    places = alignment.places(matches, count, ref)
    given = list(range(len(images)))
    if places is None or not np.isfinite(places).all():
        strange = (
            []
            if places is None
            else [name for name, place in zip(names, places, strict=False) if not np.isfinite(place)]
        )
        match = f"match in {', '.join(strange)}: are these views of this scene?" if strange else "match to measure it"
        return given, None, [f"the order of the views is that of their names: too few features {match}"]
    found = alignment.disparities(matches, places)
    order, notes = given, []
    # most disparities are positive in a scene: if they come out negative, the names run from right to left
    if len(found) and np.median(found) < 0 and np.mean(found < 0) > 0.9:
        places, found = -places, -found
    if count == len(images):
        order = [int(index) for index in np.argsort(places, kind="stable")]
        if order != given:
            notes.append("the views are listed as they were taken, left to right, not by their names")
        apart = np.abs(np.diff(places[order]) - 1).max()
        if apart > _OUT_OF_ORDER:
            notes.append("the views were not taken at even steps: matbench needs even steps")
    if len(found) < _SURE:
        return order, None, notes
    low, high = (float(value) for value in np.quantile(found, (0.01, 0.99)))
    margin = 2 + _MARGIN * max(-low, high)
    return order, Range(floor(low - margin) if low < 0 else 0, ceil(high + margin)), notes


def _truth(folder: Path, names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """View -> the truth file that seems to belong to it, and that file's encoding."""
    found: dict[str, tuple[str, str]] = {}
    files = sorted((path.name for path in folder.iterdir() if path.suffix.lower() in (*_IMAGES, ".pfm")), key=natural)
    for file in files:
        if file in names or not (_NO_VIEW.search(file) or file.lower().endswith(".pfm")):
            continue
        view = next((name for name in names if _belongs(file, name)), None)
        if view is not None and view not in found and not re.search(r"mask|nocc|depth", file, re.IGNORECASE):
            try:
                found[view] = file, encoding(folder / file)
            except UserError:
                continue
    return found


def _belongs(truth: str, view: str) -> bool:
    """Does the truth file's name hold the view's number or, for a view without a number, its whole name?"""
    numbers, wanted = (re.findall(r"[0-9]+", Path(name).stem) for name in (truth, view))
    if wanted:
        return bool(numbers) and int(numbers[-1]) == int(wanted[-1])
    return Path(view).stem.lower() in truth.lower()


def _text(
    names: Sequence[str],
    disparities: Range,
    is_given: bool,
    is_measured: bool,
    truth: dict[str, tuple[str, str]],
) -> str:
    def said(name: str) -> str:
        return json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")

    listed = "\n".join(f"    {said(name)}," for name in names)
    source = "" if is_given else "; measured, with a wide margin" if is_measured else "; A GUESS, set it"
    middle = names[(len(names) - 1) // 2]
    lines = [
        "# A scene: rectified views, taken at even steps along a line.",
        "# 'matbench scene check' measures whether it is one, 'matbench scene show' draws it.",
        "",
        "# from left to right: nearer points move left from each view to the next",
        f"views = [\n{listed}\n]",
        "",
        f"# least and largest, pixels per view step (between neighbouring views){source}",
        f"disparities = [{disparities.least:g}, {disparities.largest:g}]",
        "",
        "# the view that is scored; by default the middle one of those that have truth",
        f"# reference = {said(middle)}",
        "",
        "# errors are given in pixels between views so many steps apart; by default neighbours",
        "# pair_steps = 1",
    ]
    for view, (file, kind) in (truth or {middle: ("truth.png", "grey8")}).items():
        # the numbers of a grey picture mean nothing without their scale, which only a person knows
        off = "" if kind == "pfm" and truth else "# "
        lines += ["", f"{off}[truth.{said(view)}]", f"{off}file = {said(file)}"]
        if kind == "pfm" and truth:
            lines.append("# scale = 1    # stored number of one pixel per view step")
        else:
            lines.append("# scale = 16   # SET IT: the grey level of one pixel per view step")
        lines.append("# unknown = 0  # stored number that means unknown")
    return "\n".join(lines) + "\n"
