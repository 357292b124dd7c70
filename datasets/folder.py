"""Users' own scenes: a folder of images with a ``scene.toml``, or a pair in the folder layout of Middlebury.

    views = ["left.png", "middle.png", "right.png"]   # from left to right, evenly spaced
    disparities = [0, 16]                             # least and largest, pixels per view step
    reference = "middle.png"                          # the view that is scored (optional)
    pair_steps = 1                                    # errors are in px between views this far apart (optional)

    [truth."middle.png"]                              # for any views (optional)
    file = "middle_disparity.png"                     # grey PNG or PGM of 8 or 16 bits, or PFM
    scale = 16                                        # stored number of one pixel per view step; 1 for PFM
    unknown = 0                                       # stored number that means unknown; none for PFM
    encoding = "grey8"                                # grey8, grey16 or pfm: checked if given (optional)

Nothing outside the folder is read, whatever the file says.
"""

import re
import shlex
import tomllib
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from matbench.datasets.pair import CALIBRATION, pair
from matbench.datasets.stored import StoredScene, TruthFile, check_options, inside
from matbench.errors import UserError, one_line, unknown
from matbench.files.images import encoding, read_bytes
from matbench.scene import Range, Scene
from matbench.scenes.dataset import Listing

TOML = "scene.toml"
_FARTHEST = 9999  # pixels per view step, far beyond the width of images
MOST_VIEWS = 1000

_KEYS = ("disparities", "pair_steps", "reference", "truth", "views")
_TRUTH_KEYS = ("encoding", "file", "scale", "unknown")
_LARGEST_TOML = 1 << 20
_LONGEST_NAME = 1000


class Folder:
    """Scenes named by the path of their folder."""

    def listings(self, root: Path | None) -> Sequence[Listing]:  # noqa: ARG002
        """No scenes: folders are named by their users and not known beforehand."""
        return []

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:  # noqa: ARG002
        """Load the scene in the folder `name`; options are `stored.OPTIONS`."""
        found = describe(name)
        check_options(name, options)
        return found.load(options)


def describe(called: str) -> StoredScene:
    """Read the description of the scene in a folder. Its images are not read yet.

    Raises
    ------
    UserError
        If the folder holds no scene, or its description is malformed.
    """
    folder = Path(called)
    if not folder.is_dir():
        raise UserError(f"scene folder {called!r} does not exist")
    if (folder / TOML).exists():
        return read(called, folder)
    if (folder / CALIBRATION).exists():
        return pair(called, folder)
    raise UserError(
        f"folder {called!r} holds no scene: neither {TOML} nor {CALIBRATION} is in it; "
        f"{shlex.join(['matbench', 'scene', 'new', called])} writes a {TOML} for its images"
    )


def read(called: str, folder: Path) -> StoredScene:
    """Read a folder's ``scene.toml``."""
    path = folder / TOML
    found = _parsed(path)
    for key in found:
        if key not in _KEYS:
            raise unknown(f"key of {path}", key, _KEYS)
    names = _views(path, found.get("views"))
    files = [_inside(path, folder, name) for name in names]
    reference = found.get("reference")
    steps = found.get("pair_steps", 1)
    if isinstance(steps, bool) or not isinstance(steps, int) or not 1 <= steps < len(names):
        raise UserError(f"{path}: pair_steps = {_said(steps)} is no whole number from 1 to {len(names) - 1}")
    return StoredScene(
        called=called,
        views=tuple(files),
        labels=labels(names),
        disparities=_disparities(path, found.get("disparities")),
        truth=_truth(path, folder, names, found.get("truth", {})),
        pair_steps=steps,
        preferred=() if reference is None else (_view(path, names, reference, "reference"),),
    )


def labels(names: Sequence[str]) -> tuple[str, ...]:
    """Labels of views: the numbers in their file names if these increase and nothing else differs, else 0, 1, ...

    >>> labels(["im2.png", "im6.png", "im10.png"])
    ('2', '6', '10')
    >>> labels(["left.png", "right.png"])
    ('0', '1')
    """
    parts = [re.fullmatch(r"(.*?)([0-9]{1,6})(\D*)", name, re.DOTALL) for name in names]
    found = [(part[1], int(part[2]), part[3]) for part in parts if part]
    numbers = [number for _, number, _ in found]
    same = len({(before, after) for before, _, after in found}) == 1
    increasing = numbers == sorted(set(numbers))
    chosen = numbers if same and increasing and len(found) == len(names) else range(len(names))
    return tuple(map(str, chosen))


def _parsed(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_bytes(path, "scene file", _LARGEST_TOML).decode("utf-8"))
    except RecursionError:
        raise UserError(f"{path} is not TOML: it is nested too deeply") from None
    except ValueError as error:
        raise UserError(f"{path} is not TOML: {one_line(error)}") from None


def _said(value: object) -> str:
    """A value as messages show it, cut to 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _views(path: Path, given: object) -> list[str]:
    if not (isinstance(given, list) and all(isinstance(name, str) for name in given)):
        found = "is missing" if given is None else f"= {_said(given)}"
        raise UserError(f"{path}: views {found}: write a list of image files, left to right: views = ['im0.png', ...]")
    if not 2 <= len(given) <= MOST_VIEWS:
        raise UserError(f"{path}: views names {len(given)} files: 2 to {MOST_VIEWS} are possible")
    twice = next((name for k, name in enumerate(given) if name in given[:k]), None)
    if twice is not None:
        raise UserError(f"{path}: views names {_said(twice)} twice")
    return given


def _inside(path: Path, folder: Path, name: object) -> Path:
    if not (isinstance(name, str) and 0 < len(name) <= _LONGEST_NAME):
        raise UserError(f"{path}: {_said(name)} is no file name")
    try:
        return inside(folder, name)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def _disparities(path: Path, given: object) -> Range:
    bounds = [_number(one) for one in given] if isinstance(given, list) else []
    if len(bounds) != 2 or None in bounds:
        found = "is missing" if given is None else f"= {_said(given)}"
        raise UserError(
            f"{path}: disparities {found}: write the least and the largest in pixels per view step, "
            "such as disparities = [0, 16]"
        )
    if any(abs(bound) > _FARTHEST for bound in bounds if bound is not None):
        raise UserError(f"{path}: disparities = {_said(given)}: at most {_FARTHEST} pixels per view step are searched")
    try:
        return Range(*(float(bound) for bound in bounds if bound is not None))
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def _number(value: object) -> float | None:
    """A finite number, or None if it is anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if isfinite(number) else None


def _view(path: Path, names: Sequence[str], given: object, what: str) -> int:
    """Index of the view with that file name, given with or without its ending."""
    stems = [name.rpartition(".")[0] or name for name in names]
    if isinstance(given, str):
        for known in (list(names), stems):
            if known.count(given) == 1:
                return known.index(given)
    raise unknown(f"view in {path} ({what})", given if isinstance(given, str) else _said(given), names)


def _truth(path: Path, folder: Path, names: Sequence[str], given: object) -> dict[int, TruthFile]:
    if not isinstance(given, dict):
        raise UserError(f"{path}: truth = {_said(given)}: write a table [truth.{_said(names[0])}] with file and scale")
    found: dict[int, TruthFile] = {}
    for name, facts in given.items():
        index = _view(path, names, name, "truth")
        if index in found:
            raise UserError(f"{path}: truth of view {names[index]} stands twice")
        found[index] = _truth_file(path, folder, name, facts)
    return found


def _truth_file(path: Path, folder: Path, name: str, facts: object) -> TruthFile:
    where = f"{path}: truth of {name}"
    if not isinstance(facts, dict):
        raise UserError(f"{where} is {_said(facts)}: write file = '...' and scale = ... below [truth.{_said(name)}]")
    for key in facts:
        if key not in _TRUTH_KEYS:
            raise unknown(f"key of {where}", key, _TRUTH_KEYS)
    file = _inside(path, folder, facts.get("file"))
    found = encoding(file)
    if facts.get("encoding", found) != found:
        raise UserError(f"{where}: encoding = {_said(facts['encoding'])}, but {file} is {found}")
    if found != "pfm" and "scale" not in facts:
        raise UserError(f"{where} lacks scale: the grey level that one pixel per view step has, such as scale = 16")
    scale = _number(facts.get("scale", 1))
    if scale is None or scale <= 0:
        raise UserError(f"{where}: scale = {_said(facts['scale'])} is no number above 0")
    nothing = _number(facts["unknown"]) if "unknown" in facts else None
    if "unknown" in facts and nothing is None:
        raise UserError(f"{where}: unknown = {_said(facts['unknown'])} is no finite number; leave it out for none")
    return TruthFile(file, scale, nothing)


FOLDER = Folder()
