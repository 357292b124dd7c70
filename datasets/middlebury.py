"""The Middlebury scenes of 2001, 2003, 2005 and 2006, as their site lays them out.

Below the data root lie ``middlebury/scenes2001/data/SCENE``, ``scenes2003/newdata/SCENE`` and
``newdata/half/SCENE``, ``scenes2005/ThirdSize/SCENE`` and so on. Truth is stored as grey levels, a
whole number of them for each pixel of disparity between the two views of the field's pair.

References: Scharstein & Szeliski, IJCV 2002 (2001); Scharstein & Szeliski, CVPR 2003 (2003);
Scharstein & Pal, CVPR 2007, and Hirschmueller & Scharstein, CVPR 2007 (2005, 2006).
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from math import ceil
from pathlib import Path

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench import spec
from matbench.dataset import Listing
from matbench.datasets.choose import search_range, views_and_reference
from matbench.datasets.images import read_grey, read_rgb, read_size
from matbench.errors import UserError, unknown
from matbench.regions import regions
from matbench.scene import Range, Scene

OPTIONS = ("baseline", "disparities", "ref", "size", "views")

_EXTENSIONS = (".png", ".ppm", ".pgm")
_PREFIXES = ("im", "view")
_ROUND_UP = 16  # px of the pair, for ranges that come from the truth itself


@frozen
class Layout:
    """How the files of a scene are named and what its truth means.

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
    view, truth
        File names without extension, the view's number as ``{}``.
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
    numbers: range
    pair: tuple[int, int]
    grey: int
    view: str = "view{}"
    truth: str = "disp{}"
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


@cache
def _facts() -> dict[str, dict[str, dict[str, tuple[int, int]]]]:
    """Year -> scene -> size -> (width, height)."""
    text = Path(__file__).with_name("middlebury_facts.json").read_text("utf-8")
    return {
        year: {name: {size: (w, h) for size, (w, h) in sizes.items()} for name, sizes in scenes.items()}
        for year, scenes in json.loads(text).items()
    }


def _find(folder: Path, stem: str) -> Path | None:
    """The image file of that name, whatever its format."""
    return next((path for end in _EXTENSIONS if (path := folder / f"{stem}{end}").is_file()), None)


def _found(folder: Path, stem: str) -> Path:
    path = _find(folder, stem)
    if path is None:
        raise UserError(f"image {folder / stem} is missing ({' or '.join(_EXTENSIONS)})")
    return path


@frozen
class Middlebury:
    """One year's scenes.

    Parameters
    ----------
    year
        As in the folder's name.
    layouts
        Size -> layout; where nothing is said, the first size that a scene's folders have.
    special
        Scenes laid out in a way of their own.
    """

    year: str
    layouts: Mapping[str, Layout]
    special: Mapping[str, Layout] = field(factory=dict)

    def listings(self, root: Path | None) -> Sequence[Listing]:
        """All scenes of the year, with those that only the data root knows."""
        known = _facts()[self.year]
        names = sorted({*known, *self._names_present(root)}, key=lambda name: (name.lower(), name))
        return [self._listing(name, known.get(name, {}), root) for name in names]

    def _listing(self, name: str, known: Mapping[str, tuple[int, int]], root: Path | None) -> Listing:
        here = self._sizes_present(name, root)
        sizes = {size: known[size] if size in known else self._size_of(name, size, root) for size in here}
        sizes |= {size: known[size] for size in self.layouts if size in known and size not in sizes}
        default = next(iter(sizes))
        layout = self._layout(name, default)
        complete = False
        if root is not None and default in here:
            folder = self._folder(root, name, default)
            complete = all(_find(folder, layout.view.format(k)) for k in layout.numbers) and any(
                _find(folder, layout.truth.format(k)) for k in layout.with_truth
            )
        return Listing(name, len(layout.numbers), sizes, complete)

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:
        """Load a scene; options are `size`, `views`, `baseline`, `ref` and `disparities`.

        Only the chosen views are read, and the truth of every view that has it.
        """
        called = f"middlebury{self.year}/{name}"
        for option in options:
            if option not in OPTIONS:
                raise unknown(f"option of {called}", option, OPTIONS)
        folder, layout = self._locate(called, name, options.get("size"), root)
        labels = [layout.label.format(number) for number in layout.numbers]
        searched = search_range(called, options.get("disparities"), layout.steps)
        have = [number for number in layout.with_truth if _find(folder, layout.truth.format(number))]
        if not have:
            raise UserError(f"{called} has no ground truth in {folder}: a scene without it cannot be scored")
        indices = [layout.numbers.index(number) for number in have]
        chosen, ref = views_and_reference(called, labels, indices, options, _PREFIXES)

        images = {ref: read_rgb(_found(folder, layout.view.format(layout.numbers[ref])))}
        height, width = images[ref].shape[:2]
        for index in chosen:
            if index != ref:
                images[index] = read_rgb(_found(folder, layout.view.format(layout.numbers[index])), (width, height))
        truth = {index: self._truth(folder, layout, layout.numbers[index], (width, height)) for index in indices}
        views = np.zeros((len(labels), height, width, 3), np.uint8)  # those not chosen are dropped below
        for index, image in images.items():
            views[index] = image
        other = layout.steps if layout.numbers[ref] == layout.pair[0] else -layout.steps
        full = Scene(
            name=spec.label(called, dict(sorted(options.items()))),
            views=views,
            labels=tuple(labels),
            ref=ref,
            disparities=searched or Range(0, self._largest(layout, truth.values()) / layout.steps),
            truth=truth,
            pair_steps=layout.steps,
            regions=regions(images[ref], truth[ref], other),
        )
        return full if len(chosen) == len(labels) else full.choose(chosen)

    def _truth(self, folder: Path, layout: Layout, number: int, size: tuple[int, int]) -> NDArray[np.float32]:
        """(H, W) float32, px per view step, NaN where unknown."""
        path = _found(folder, layout.truth.format(number))
        grey = read_grey(path, size)
        truth = grey.astype(np.float32) / np.float32(layout.grey * layout.steps)
        if layout.unknown is not None:
            truth[grey == layout.unknown] = np.nan
        if np.isnan(truth).all():
            raise UserError(f"ground truth {path} is unknown everywhere: it must hold grey levels above 0")
        return truth

    @staticmethod
    def _largest(layout: Layout, truths: Iterable[NDArray[np.float32]]) -> float:
        """Largest disparity to search, px of the pair."""
        if layout.largest is not None:
            return layout.largest
        nearest = max(float(np.nanmax(truth)) for truth in truths) * layout.steps
        return max(1, ceil(nearest / _ROUND_UP - 1e-6)) * _ROUND_UP

    def _locate(self, called: str, name: str, size: str | None, root: Path | None) -> tuple[Path, Layout]:
        """The folder of a scene and its layout.

        Raises
        ------
        UserError
            If the scene or size does not exist, or is not there.
        """
        known, present = _facts()[self.year], self._names_present(root)
        # nothing else is ever joined to a path
        if name not in known and name not in present:
            raise unknown(f"scene of middlebury{self.year}", name, {*known, *present})
        possible = [s for s in self.layouts if s in known.get(name, {}) or s in self._sizes_present(name, root)]
        if size is not None and size not in possible:
            raise unknown(f"size of {called}", size, possible)
        if root is None:
            raise UserError(
                f"{called} is a real scene: name the folder that holds middlebury/ by --data or MATBENCH_DATA"
            )
        here = self._sizes_present(name, root)
        wanted = size or next(iter(here), possible[0])
        folder = self._folder(root, name, wanted)
        if wanted not in here:
            others = f"size {', '.join(here)}" if here else ", ".join(present) or "no scenes of that year"
            raise UserError(f"{called} (size {wanted}) is not in {folder}: present: {others}")
        return folder, self._layout(name, wanted)

    def _layout(self, name: str, size: str) -> Layout:
        return self.special.get(name, self.layouts[size])

    def _folder(self, root: Path, name: str, size: str) -> Path:
        return root / "middlebury" / self._layout(name, size).folder / name

    def _is_present(self, name: str, size: str, root: Path) -> bool:
        """Does the folder hold any view of that layout?"""
        folder, layout = self._folder(root, name, size), self._layout(name, size)
        return any(_find(folder, layout.view.format(number)) for number in layout.numbers)

    def _sizes_present(self, name: str, root: Path | None) -> list[str]:
        """The sizes of a scene of that checked name, in order of preference."""
        return [size for size in self.layouts if root is not None and self._is_present(name, size, root)]

    def _names_present(self, root: Path | None) -> list[str]:
        if root is None:
            return []
        parents = {size: root / "middlebury" / layout.folder for size, layout in self.layouts.items()}
        return sorted(
            {
                path.name
                for size, parent in parents.items()
                if parent.is_dir()
                for path in parent.iterdir()
                if re.fullmatch(r"[A-Za-z0-9_]+", path.name) and self._is_present(path.name, size, root)
            }
        )

    def _size_of(self, name: str, size: str, root: Path | None) -> tuple[int, int]:
        """(width, height) as the first view's header states it; (0, 0) if it is damaged."""
        assert root is not None, "only sizes that are present are looked at"  # noqa: S101
        folder, layout = self._folder(root, name, size), self._layout(name, size)
        paths = (_find(folder, layout.view.format(number)) for number in layout.numbers)
        try:
            return read_size(next(path for path in paths if path))
        except UserError:
            return 0, 0


MIDDLEBURY_2001 = Middlebury(
    "2001",
    {"full": Layout("scenes2001/data", range(9), (2, 6), 8, view="im{}", unknown=None, largest=19)},
    {
        "tsukuba": Layout(
            "scenes2001/data",
            range(1, 6),
            (3, 4),
            16,
            view="scene1.row3.col{}",
            truth="truedisp.row3.col{}",
            largest=15,
            label="col{}",
            with_truth=(3,),
        )
    },
)

MIDDLEBURY_2003 = Middlebury(
    "2003",
    {
        "quarter": Layout("scenes2003/newdata", range(9), (2, 6), 4, view="im{}", largest=59),
        "half": Layout("scenes2003/newdata/half", range(2, 7), (2, 6), 2, largest=118),
    },
)


def _in_three_sizes(year: str) -> Middlebury:
    sizes = {"third": ("ThirdSize", 3), "half": ("HalfSize", 2), "full": ("FullSize", 1)}
    return Middlebury(
        year,
        {size: Layout(f"scenes{year}/{folder}", range(7), (1, 5), grey) for size, (folder, grey) in sizes.items()},
    )


MIDDLEBURY_2005 = _in_three_sizes("2005")
MIDDLEBURY_2006 = _in_three_sizes("2006")
