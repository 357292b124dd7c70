"""Light fields of the HCI 4D benchmark: any row or column of their 9x9 views is a scene.

In ``hci/CATEGORY/SCENE`` below the data root lie the views ``input_Cam000.png`` to ``input_Cam080.png``, row by
row from the upper left one; ``gt_disp_lowres.pfm``, the truth of the centre view; for some scenes
``gt_disp_lowres_Cam000.pfm`` and so on, that of all views; and ``parameters.cfg``. Disparities have a sign. The
benchmark's thresholds are in pixels between neighbouring views, so two neighbours are its pair.

The benchmark leaves the outer 15 pixels out: that is region ``inner``. Its masks of the centre view (``mask_planes``,
``mask_smooth_surfaces``, ``mask_discontinuities``, ``mask_fine``, ``mask_fine_surrounding``, each with
``_lowres.png``) are regions where they are there. Its program scores the last three on maps of ten times the size;
matbench does not.

Reference: Honauer, Johannsen, Kondermann & Goldluecke, ACCV 2016.
"""

import re
from collections.abc import Mapping, Sequence
from configparser import ConfigParser
from configparser import Error as ConfigError
from pathlib import Path

from matbench.datasets.stored import StoredScene, TruthFile, check_options
from matbench.errors import UserError, one_line, unknown
from matbench.files.images import read_bytes
from matbench.scene import Range, Scene
from matbench.scenes.dataset import Listing

SIDE, SIZE = 9, (512, 512)

RANGE = Range(-4, 4)
"""Px per view step: what is searched where there is no ``parameters.cfg``. It holds the truth of every scene of
the benchmark, with a little to spare."""

SCENES = {
    "additional": (
        "antinous boardgames dishes greek kitchen medieval2 museum pens pillows platonic rosemary table tomb tower "
        "town vinyl"
    ),
    "stratified": "backgammon dots pyramids stripes",
    "test": "bedroom bicycle herbs origami",
    "training": "boxes cotton dino sideboard",
}
_CATEGORY = {name: category for category, names in SCENES.items() for name in names.split()}
_CENTRE = SIDE // 2
_BORDER = 15
_MASKS = ("planes", "smooth_surfaces", "discontinuities", "fine", "fine_surrounding")
_TRUTH = "gt_disp_lowres.pfm"
_UNPUBLISHED = "test"  # the category whose truth its makers keep
_LARGEST_CFG = 1 << 16


class HCI:
    """The light fields."""

    def listings(self, root: Path | None) -> Sequence[Listing]:
        """All scenes of the benchmark, and what else the data root has in its layout."""
        folders = _folders(root)
        names = sorted({*_CATEGORY, *folders})
        views = [_image(_CENTRE * SIDE + k) for k in range(SIDE)]
        present = {n: all((folders[n] / file).is_file() for file in views) for n in folders}
        truth = {n: (folders[n] / _TRUTH).is_file() for n in folders}
        return [
            Listing(
                name,
                SIDE,
                {"512x512": SIZE},
                present.get(name, False),
                truth=truth.get(name, _CATEGORY.get(name) != _UNPUBLISHED),
            )
            for name in names
        ]

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:
        """Load a row or a column of views, by default the middle row.

        Options: `row` or `column` from 0 (top, left) to 8; `views` and `baseline` to keep and `ref`
        to score, by their number in it; `disparities` to search.
        """
        called = f"hci/{name}"
        check_options(called, options, ("column", "row"))
        folders = _folders(root)
        if name not in _CATEGORY and name not in folders:
            raise unknown("scene of hci", name, {*_CATEGORY, *folders})
        if root is None:
            raise UserError(f"{called} is a real scene: name the folder that holds hci/ by --data or MATBENCH_DATA")
        if name not in folders:
            raise UserError(f"{called} is not in {root / 'hci' / _CATEGORY[name] / name}")
        folder, places = folders[name], _places(called, options)
        truth: dict[int, TruthFile] = {}
        masks = {name: path for name in _MASKS if (path := folder / f"mask_{name}_lowres.png").is_file()}
        for index, place in enumerate(places):
            files = [_TRUTH] if place == SIDE * SIDE // 2 else []
            files.append(f"gt_disp_lowres_Cam{place:03}.pfm")
            found = next((path for file in files if (path := folder / file).is_file()), None)
            truth |= {} if found is None else {index: TruthFile(found)}
        stored = StoredScene(
            called=called,
            views=tuple(folder / _image(place) for place in places),
            labels=tuple(str(k) for k in range(SIDE)),
            disparities=read_range(folder),
            truth=truth,
            masks={place: masks for place, view in enumerate(places) if view == SIDE * SIDE // 2},
            border=_BORDER,
            metrics="hci",
            column="column" in options,
        )
        return stored.load(options)


def _image(place: int) -> str:
    return f"input_Cam{place:03}.png"


def _folders(root: Path | None) -> dict[str, Path]:
    """Name -> folder of every light field that is there."""
    if root is None:
        return {}
    found = sorted((root / "hci").glob("*/*"), reverse=True)  # of two of one name, the first category wins
    return {path.name: path for path in found if re.fullmatch(r"[A-Za-z0-9_]+", path.name) and path.is_dir()}


def _places(called: str, options: Mapping[str, str]) -> list[int]:
    """Numbers of the views of a row or a column, from left to right or from top to bottom."""
    if "row" in options and "column" in options:
        raise UserError(f"{called}: row={options['row']} and column={options['column']} cannot both be given")
    across = "column" not in options
    text = options.get("row" if across else "column", str(_CENTRE))
    if not re.fullmatch(rf"[0-{SIDE - 1}]", text):
        kind, first = ("row", "top") if across else ("column", "left")
        raise UserError(f"{kind}={text} of {called}: a number from 0 ({first}) to {SIDE - 1} is possible")
    line = int(text)
    return [line * SIDE + k if across else k * SIDE + line for k in range(SIDE)]


def read_range(folder: Path) -> Range:
    """The range to search: as ``parameters.cfg`` says, else `RANGE`.

    Raises
    ------
    UserError
        If the file is there but cannot be read.
    """
    path = folder / "parameters.cfg"
    if not path.exists():
        return RANGE
    # no interpolation: it would let a small file grow without bounds
    parser = ConfigParser(interpolation=None)
    try:
        parser.read_string(read_bytes(path, "parameters", _LARGEST_CFG).decode("utf-8"))
    except UnicodeDecodeError:
        raise UserError(f"parameters {path} are no text (UTF-8)") from None
    except ConfigError as error:
        raise UserError(f"parameters {path} cannot be read: {one_line(error)}") from None
    bounds = []
    for key in ("disp_min", "disp_max"):
        text = parser.get("meta", key, fallback="")
        try:
            bounds.append(float(text))
        except ValueError:
            raise UserError(f"parameters {path}: {key} = {text!r} in [meta] is no number") from None
    try:
        return Range(*bounds)
    except UserError as error:
        raise UserError(f"parameters {path}: {error}") from None


HCI_4D = HCI()
