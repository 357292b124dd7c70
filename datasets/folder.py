"""Users' own scenes: a folder of images with a ``scene.toml``, or one in the layout of a published dataset.

    views = ["left.png", "middle.png", "right.png"]   # from left to right
    positions = [0, 1, 2.5]                           # where they were taken, if not at even steps (optional)
    vertical = true                                   # views from top to bottom instead; they are turned (optional)
    disparities = [0, 16]                             # least and largest, pixels per view step
    reference = "middle.png"                          # the view that is scored (optional)
    pair_steps = 1                                    # errors are in px between views this far apart (optional)
    metrics = "kitti"                                 # what is reported: eth3d, hci, kitti or middlebury (optional)

    [truth."middle.png"]                              # for any views (optional)
    file = "middle_disparity.png"                     # grey PNG or PGM of 8 or 16 bits, PFM, NPY, NPZ or TIFF
    scale = 16                                        # stored number of one pixel per view step; 1 where not grey
    unknown = 0                                       # stored number that means unknown, besides what is not finite
    encoding = "grey8"                                # grey8, grey16, pfm, npy, npz, tiff: checked (optional); sintel
    mask = "mask0nocc.png"                            # 255 where the pair's other view sees the point (optional)
    sparse = true                                     # known at scattered pixels only (optional: else measured)

    [regions."middle.png"]                            # further regions of a view (optional)
    planes = "planes.png"                             # name -> grey image, black outside of the region

Nothing outside the folder is read, whatever the file says. The other layouts are in `pair` and `sequences`.
"""

import os
import re
import shlex
from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path
from types import MappingProxyType

from matbench.datasets.pair import CALIBRATION, pair
from matbench.datasets.sequences import FRAME, PASS, matching, sequence, sequences_in
from matbench.datasets.stored import SeenFile, StoredScene, TruthFile, check_options, inside
from matbench.errors import UserError, refuse_hidden, unknown
from matbench.files.images import encoding
from matbench.files.toml import read_toml
from matbench.measures.benchmarks import SETS
from matbench.regions import VIEW_REGIONS
from matbench.scene import SAME_PLACE, Range, Scene
from matbench.scenes.dataset import Listing

TOML = "scene.toml"
_FARTHEST = 9999  # pixels per view step, far beyond the width of images
MOST_VIEWS = 1000

_KEYS = ("disparities", "metrics", "pair_steps", "positions", "reference", "regions", "truth", "vertical", "views")
_TRUTH_KEYS = ("encoding", "file", "mask", "scale", "sparse", "unknown")
_PACKED = "sintel"
_LONGEST_NAME = 1000


class Folder:
    """Scenes named by the path of their folder."""

    def listings(self, root: Path | None) -> Sequence[Listing]:  # noqa: ARG002
        """No scenes: folders are named by their users and not known beforehand."""
        return []

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:  # noqa: ARG002
        """Load the scene in the folder `name`; options are `stored.OPTIONS`."""
        check_options(name, options, (FRAME, PASS) if sequences_in(name) else ())
        return describe(name, options).load(options)

    def expand(self, name: str, options: Mapping[str, str]) -> Sequence[Mapping[str, str]]:
        """The options of every scene that a pattern among them means: of a folder with many pairs, its frames."""
        if "*" not in options.get(FRAME, "") or not sequences_in(name):
            return [options]
        return [{**options, FRAME: frame} for frame in matching(name, options)]


def describe(called: str, options: Mapping[str, str] = MappingProxyType({})) -> StoredScene:
    """Read the description of the scene in a folder. Its images are not read yet.

    Parameters
    ----------
    options
        Of a folder with many pairs, `FRAME` says which one.

    Raises
    ------
    UserError
        If the folder holds no scene, or its description is malformed.
    """
    folder = Path(called)
    if not os.path.isdir(folder):  # noqa: PTH112 (of a name that no folder can have, `Path` raises)
        raise UserError(f"scene folder {called!r} does not exist")
    if (folder / TOML).exists():
        return read(called, folder)
    if (folder / CALIBRATION).exists():
        return pair(called, folder)
    if sequences_in(called):
        return sequence(called, folder, options)
    raise UserError(
        f"folder {called!r} holds no scene: neither {TOML} nor {CALIBRATION} is in it; "
        f"{shlex.join(['matbench', 'scene', 'new', called])} writes a {TOML} for its images"
    )


def read(called: str, folder: Path) -> StoredScene:
    """Read a folder's ``scene.toml``."""
    path = folder / TOML
    found = read_toml(path, "scene file")
    for key in found:
        if key not in _KEYS:
            raise unknown(f"key of {path}", key, _KEYS)
    names = _views(path, folder, found.get("views"))
    files = [_inside(path, folder, name) for name in names]
    reference = found.get("reference")
    positions = _positions(path, found.get("positions"), len(names))
    vertical = _flag(str(path), "vertical", found.get("vertical", False))
    truth, seen, sparse = _truth(path, folder, names, found.get("truth", {}))
    return StoredScene(
        called=called,
        views=tuple(files),
        labels=labels(names),
        disparities=_disparities(path, found.get("disparities")),
        truth=truth,
        pair_steps=_pair_steps(path, found.get("pair_steps", 1), positions, len(names)),
        positions=positions,
        seen=seen,
        sparse=sparse,
        column=vertical,
        preferred=() if reference is None else (_view(path, names, reference, "reference"),),
        masks=_masks(path, folder, names, found.get("regions", {})),
        metrics=_metrics(path, found.get("metrics", "")),
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


def _said(value: object) -> str:
    """A value as messages show it, cut to 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _positions(path: Path, given: object, count: int) -> tuple[float, ...]:
    """Where the views were taken, from the first one on; empty for even steps of 1."""
    if given is None:
        return ()
    numbers = [_number(one) for one in given] if isinstance(given, list) else []
    places = [number for number in numbers if number is not None]
    if len(places) != len(numbers) or len(places) != count:
        raise UserError(
            f"{path}: positions = {_said(given)}: write where each of the {count} views was taken, in view steps, "
            "such as positions = [0, 1, 2.5]"
        )
    if any(not SAME_PLACE < b - a <= _FARTHEST for a, b in pairwise(places)):
        raise UserError(f"{path}: positions = {_said(given)} do not increase: list the views from left to right")
    found = tuple(place - places[0] for place in places)
    return () if found == tuple(range(count)) else found


def _pair_steps(path: Path, given: object, positions: Sequence[float], count: int) -> float:
    """View steps of the pair: a whole number unless views lie at uneven positions."""
    if positions:
        steps = _number(given)
        if steps is None or not 0 < steps <= positions[-1]:
            raise UserError(f"{path}: pair_steps = {_said(given)} is no number above 0, up to {positions[-1]:g}")
        return steps
    if isinstance(given, bool) or not isinstance(given, int) or not 1 <= given < count:
        raise UserError(f"{path}: pair_steps = {_said(given)} is no whole number from 1 to {count - 1}")
    return given


def _flag(where: str, key: str, given: object) -> bool:
    if not isinstance(given, bool):
        raise UserError(f"{where}: {key} = {_said(given)} is neither true nor false")
    return given


def _views(path: Path, folder: Path, given: object) -> list[str]:
    if not (isinstance(given, list) and all(isinstance(name, str) for name in given)):
        found = "is missing" if given is None else f"= {_said(given)}"
        raise UserError(f"{path}: views {found}: write a list of image files, left to right: views = ['im0.png', ...]")
    if not 2 <= len(given) <= MOST_VIEWS:
        raise UserError(f"{path}: views names {len(given)} files: 2 to {MOST_VIEWS} are possible")
    twice = next((name for k, name in enumerate(given) if name in given[:k]), None)
    if twice is not None:
        raise UserError(f"{path}: views names {_said(twice)} twice")
    for name in given:
        _refuse_blanks(path, folder, name)
    return given


def _refuse_blanks(path: Path, folder: Path, name: str) -> None:
    """Refuse a name that only a blank at its end keeps from being that of a file: nobody sees it."""
    bare = name.strip()
    if bare and bare != name and not _is_file(folder, name) and _is_file(folder, bare):
        raise UserError(f"{path}: {_said(name)} begins or ends with a blank: write {_said(bare)}")


def _is_file(folder: Path, name: str) -> bool:
    return os.path.isfile(os.path.join(folder, name))  # noqa: PTH113, PTH118 (of a name that no file can have, `Path` raises)


def _inside(path: Path, folder: Path, name: object) -> Path:
    if not (isinstance(name, str) and 0 < len(name) <= _LONGEST_NAME):
        raise UserError(f"{path}: {_said(name)} is no file name")
    refuse_hidden(f"{path}: file", name)
    _refuse_blanks(path, folder, name)
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
        if given.strip() != given and {*names, *stems} & {given.strip()}:
            raise UserError(f"{path}: {what} {_said(given)} begins or ends with a blank: write {_said(given.strip())}")
    raise unknown(f"view in {path} ({what})", given if isinstance(given, str) else _said(given), names)


def _truth(
    path: Path, folder: Path, names: Sequence[str], given: object
) -> tuple[dict[int, TruthFile], dict[int, SeenFile], bool | None]:
    """The files of truth, the masks, and whether the truth is said to be sparse or dense."""
    if not isinstance(given, dict):
        raise UserError(f"{path}: truth = {_said(given)}: write a table [truth.{_said(names[0])}] with file and scale")
    found: dict[int, TruthFile] = {}
    seen: dict[int, SeenFile] = {}
    said: set[bool] = set()
    for name, facts in given.items():
        index = _view(path, names, name, "truth")
        if index in found:
            raise UserError(f"{path}: truth of view {names[index]} stands twice")
        found[index] = _truth_file(path, folder, name, facts)
        if "mask" in facts:
            seen[index] = SeenFile((_inside(path, folder, facts["mask"]),), "mask")
        if "sparse" in facts:
            said.add(_flag(f"{path}: truth of {name}", "sparse", facts["sparse"]))
    if len(said) > 1:
        raise UserError(f"{path}: the truth of one view is sparse and that of another is not: all or none can be")
    return found, seen, said.pop() if said else None


def _masks(path: Path, folder: Path, names: Sequence[str], given: object) -> dict[int, dict[str, Path]]:
    """View index -> region -> its mask."""
    tables = given.items() if isinstance(given, dict) else [("", given)]
    found: dict[int, dict[str, Path]] = {}
    for name, masks in tables:
        if not isinstance(masks, dict):
            raise UserError(
                f"{path}: regions = {_said(given)}: write a table [regions.{_said(names[0])}] of names and grey images"
            )
        for region in masks:
            if region in ("all", *VIEW_REGIONS):
                raise UserError(f"{path}: region {region!r} of {name} is computed: give it another name")
        found[_view(path, names, name, "regions")] = {
            region: _inside(path, folder, file) for region, file in masks.items()
        }
    return found


def _metrics(path: Path, given: object) -> str:
    if not (isinstance(given, str) and given in ("", *SETS)):
        raise unknown(f"metrics in {path}", given if isinstance(given, str) else _said(given), SETS)
    return given


def _truth_file(path: Path, folder: Path, name: str, facts: object) -> TruthFile:
    where = f"{path}: truth of {name}"
    if not isinstance(facts, dict):
        raise UserError(f"{where} is {_said(facts)}: write file = '...' and scale = ... below [truth.{_said(name)}]")
    for key in facts:
        if key not in _TRUTH_KEYS:
            raise unknown(f"key of {where}", key, _TRUTH_KEYS)
    file = _inside(path, folder, facts.get("file"))
    packed = facts.get("encoding") == _PACKED
    found = _PACKED if packed else encoding(file)
    if facts.get("encoding", found) != found:
        raise UserError(f"{where}: encoding = {_said(facts['encoding'])}, but {file} is {found}")
    if found.startswith("grey") and "scale" not in facts:
        raise UserError(f"{where} lacks scale: the grey level that one pixel per view step has, such as scale = 16")
    scale = _number(facts.get("scale", 1))
    if scale is None or scale <= 0:
        raise UserError(f"{where}: scale = {_said(facts['scale'])} is no number above 0")
    nothing = _number(facts["unknown"]) if "unknown" in facts else None
    if "unknown" in facts and nothing is None:
        raise UserError(f"{where}: unknown = {_said(facts['unknown'])} is no finite number; leave it out for none")
    return TruthFile(file, scale, nothing, packed)


FOLDER = Folder()
