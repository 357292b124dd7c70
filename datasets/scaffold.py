"""Writing a ``scene.toml`` for a folder of images. The order of the views and the range are measured if possible."""

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.datasets.folder import MOST_VIEWS, TOML
from matbench.datasets.measuring import Measured, measure
from matbench.datasets.pair import CALIBRATION
from matbench.datasets.stored import inside
from matbench.errors import UserError, refuse_hidden
from matbench.files.images import ENDINGS, encoding, read_rgb, read_size
from matbench.files.maps import read_map
from matbench.files.writing import write_text
from matbench.scene import Range
from matbench.scenes.scene_check import zeros_beside

_NOT_READ = (".bmp", ".exr", ".gif", ".heic", ".webp")
_NO_VIEW = re.compile(r"disp(?!lay)|depth|truth|mask|n?o?nocc|(^|[^a-z])gt([^a-z]|$)", re.IGNORECASE)
_COLOURS = 8  # an image with no more colours is a mask


@frozen
class Truth:
    """A file of true disparities, how it stores them, and whether 0 seems to mean unknown."""

    name: str
    kind: str
    is_zero_unknown: bool


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
        If there are fewer than two images of one size, one is a link that leads out of the folder, or the folder is a
        scene already.
    """
    if not folder.is_dir():
        raise UserError(f"folder {str(folder)!r} does not exist")
    for known in (TOML, CALIBRATION):
        if (folder / known).exists() and not replace:
            raise UserError(f"{folder} is a scene already: it holds {known}; --force writes {TOML} all the same")
    given = None if disparities is None else Range(*disparities)
    names, remarks = _views(folder)
    images = {name: read_rgb(folder / name) for name in names}
    for what, is_one in (("a mask", _is_mask), ("grey where the others are coloured, as maps and masks are", _is_grey)):
        others = [name for name, image in images.items() if is_one(image)]
        # if most are so they are views all the same, such as random dots
        if others and (what == "a mask" or 2 * len(others) < len(images)) and len(others) < len(images):
            remarks += [f"left out: {name}, {what}" for name in others]
            images = {name: image for name, image in images.items() if name not in others}
            _check_count(folder, list(images))
    found = measure(images)
    chosen = given or found.disparities or Range(0, max(1, _width(images, found) // (8 * (len(found.names) - 1))))
    remarks += found.remarks
    if given is None:
        how = (
            "measured on matched features, with a wide margin"
            if found.disparities
            else "A GUESS: too few features match"
        )
        remarks.append(f"disparities {chosen} px per view step: {how}; set them yourself where you know them")
    truth, told = _truth(folder, found.names)
    path = folder / TOML
    write_text(path, _text(found, chosen, given is not None, truth))
    return Draft(path, (*remarks, *told))


def _width(images: Mapping[str, NDArray[np.uint8]], found: Measured) -> int:
    """Of a row along which views were taken."""
    return int(images[found.names[0]].shape[0 if found.vertical else 1])


def natural(name: str) -> list[tuple[int, str]]:
    """A key that sorts numbers in names by their value.

    >>> sorted(["im10.png", "im9.png"], key=natural)
    ['im9.png', 'im10.png']
    """
    parts = re.split(r"([0-9]+)", name)
    return [(int(part), "") if part.isdecimal() and part.isascii() else (-1, part.lower()) for part in parts]


def _views(folder: Path) -> tuple[list[str], list[str]]:
    """Names of the images that are taken as views, and remarks on those that are not."""
    files = [path for path in folder.iterdir() if path.suffix.lower() in ENDINGS and path.is_file()]
    images = sorted((path.name for path in files if not _NO_VIEW.search(path.stem)), key=natural)
    sizes: dict[str, tuple[int, int]] = {}
    remarks = []
    for name in images:
        file = inside(folder, name)  # as whoever reads the scene asks for
        try:
            refuse_hidden("picture", name)
            sizes[name] = read_size(file)
        except UserError as error:
            remarks.append(f"left out: {error}")
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
            f"{folder} has too few images: at least two views (PNG, JPEG, TIFF, or binary PPM or PGM), "
            f"found: {found}{hint}"
        )


def _is_mask(image: NDArray[np.uint8]) -> bool:
    """Has an image hardly any colours?"""
    for part in (image[::16], image):  # of a photograph, a few rows tell
        packed = part.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
        if len(np.unique(packed)) > _COLOURS:
            return False
    return True


def _is_grey(image: NDArray[np.uint8]) -> bool:
    return bool((image[::16] == image[::16, :, :1]).all() and (image == image[..., :1]).all())


def _truth(folder: Path, names: Sequence[str]) -> tuple[dict[str, Truth], list[str]]:
    """View -> the truth file that seems to belong to it; remarks."""
    found: dict[str, Truth] = {}
    remarks = []
    numbers = (".pfm", ".npy", ".npz")
    files = sorted((path.name for path in folder.iterdir() if path.suffix.lower() in (*ENDINGS, *numbers)), key=natural)
    for file in files:
        if file in names or not (_NO_VIEW.search(file) or file.lower().endswith(numbers)):
            continue
        view = next((name for name in names if _belongs(file, name)), None)
        if view is not None and view not in found and not re.search(r"mask|nocc|depth", file, re.IGNORECASE):
            try:
                kind = encoding(inside(folder, file))
                zeros = "" if kind.startswith("grey") else zeros_beside(read_map(inside(folder, file)))
            except UserError:
                continue
            found[view] = Truth(file, kind, bool(zeros))
            remarks += [f"{file}: {zeros}, so it is taken for unknown"] if zeros else []
    return found, remarks


def _belongs(truth: str, view: str) -> bool:
    """Does the truth file's name hold the view's number or, for a view without a number, its whole name?"""
    numbers, wanted = (re.findall(r"[0-9]+", Path(name).stem) for name in (truth, view))
    if wanted:
        return bool(numbers) and int(numbers[-1]) == int(wanted[-1])
    return Path(view).stem.lower() in truth.lower()


def _text(found: Measured, disparities: Range, is_given: bool, truth: Mapping[str, Truth]) -> str:
    def said(name: str) -> str:
        return json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")

    names = found.names
    listed = "\n".join(f"    {said(name)}," for name in names)
    source = "" if is_given else "; measured, with a wide margin" if found.disparities else "; A GUESS, set it"
    middle = names[(len(names) - 1) // 2]
    if found.vertical:
        order = ["# from top to bottom: nearer points move up from each view to the next", "vertical = true"]
    else:
        order = ["# from left to right: nearer points move left from each view to the next"]
    places = []
    if found.positions:
        told = ", ".join(f"{place:g}" for place in found.positions)
        places = ["", "# where they were taken, in view steps; measured", f"positions = [{told}]"]
    lines = [
        "# A scene: rectified views, taken along a line.",
        "# 'matbench scene check' measures whether it is one, 'matbench scene show' draws it.",
        "",
        *order,
        f"views = [\n{listed}\n]",
        *places,
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
    for view, file in (truth or {middle: Truth("truth.png", "grey8", False)}).items():
        # the numbers of a grey picture mean nothing without their scale, which only a person knows
        is_sure = not file.kind.startswith("grey")
        off = "" if is_sure else "# "
        lines += ["", f"{off}[truth.{said(view)}]", f"{off}file = {said(file.name)}"]
        if is_sure:
            lines.append("# scale = 1    # stored number of one pixel per view step")
        else:
            lines.append("# scale = 16   # SET IT: the grey level of one pixel per view step")
        lines.append(f"{'' if file.is_zero_unknown else '# '}unknown = 0  # stored number that means unknown")
    return "\n".join(lines) + "\n"
