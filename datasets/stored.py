"""Scenes kept as files: which images are their views, and what their truth files mean."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from math import ceil
from pathlib import Path
from typing import Literal

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench import spec
from matbench.datasets.choose import search_range, views_and_reference
from matbench.errors import UserError, unknown
from matbench.files.images import ENDINGS, encoding, read_levels, read_rgb, read_size
from matbench.files.maps import read_map
from matbench.files.pfm import read_disparities
from matbench.regions import is_sparse, regions
from matbench.scene import SAME_PLACE, Range, Scene

OPTIONS = ("baseline", "disparities", "ref", "views")
EXTENSIONS = (".png", ".ppm", ".pgm")
"""Of files that hold exactly the pixels of a published view."""
MOST_BYTES = 1 << 32
"""Of all views of a scene. A small file may name the same image a thousand times, by as many spellings."""
ROUND_UP = 16  # px of the pair, for ranges that come from the truth itself


def check_options(called: str, options: Iterable[str], own: Sequence[str] = ()) -> None:
    """Refuse options that a scene does not have.

    Parameters
    ----------
    own
        Names of the options that the dataset has besides `OPTIONS`.

    Raises
    ------
    UserError
        If one of them is unknown.
    """
    known = sorted((*OPTIONS, *own))
    for option in options:
        if option not in known:
            raise unknown(f"option of {called}", option, (*known, "predict"))


def image_file(folder: Path, stem: str) -> Path:
    """The image of that name in a folder, whatever its format; a PNG where there is none."""
    files = [folder / f"{stem}{end}" for end in ENDINGS]
    return next((file for file in files if file.is_file()), files[0])


def inside(folder: Path, name: str) -> Path:
    """The file of that name in a folder or below it; neither the name nor a link may lead out.

    Raises
    ------
    UserError
        If it does, or no file can have that name.
    """
    try:
        file = folder / name
        is_inside = file.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):  # too long, links in a circle, a null character
        raise UserError(f"{name!r} is no file name") from None
    if not is_inside:
        raise UserError(f"{name!r} leads out of the folder {folder}: images and truth must lie in it, so copy them")
    return file


@frozen
class TruthFile:
    """A file of true disparities: PFM, NPY, NPZ or TIFF, or a grey PNG or PGM of 8 or 16 bits.

    Parameters
    ----------
    scale
        The stored number that one pixel per view step has.
    unknown
        The stored number that means unknown, besides what is not finite; None if there is none.
    packed
        One number stands in the three channels of a coloured PNG: 4 R + G / 2^6 + B / 2^14, as in MPI Sintel
        (`disparity_read` of its `sintel_io.py`).
    """

    path: Path
    scale: float = 1.0
    unknown: float | None = None
    packed: bool = False

    def read(self, size: tuple[int, int]) -> NDArray[np.float32]:
        """(H, W) float32, pixels per view step, NaN where unknown.

        Raises
        ------
        UserError
            If it cannot be read, is unknown everywhere, or leads out of the views.
        """
        stored = self._stored(size)
        truth = stored / np.float32(self.scale)
        if self.unknown is not None:
            truth[stored == np.float32(self.unknown)] = np.nan
        if np.isnan(truth).all():
            raise UserError(f"ground truth {self.path} is unknown everywhere")
        farthest = float(np.nanmax(np.abs(truth)))
        if farthest >= size[0]:
            raise UserError(
                f"ground truth {self.path} has {farthest:g} px per view step, more than the {size[0]} px of a row: "
                f"its scale, {self.scale:g}, is not right"
            )
        return truth

    def _stored(self, size: tuple[int, int]) -> NDArray[np.float32]:
        if self.packed:
            red, green, blue = (channel.astype(np.float32) for channel in np.moveaxis(read_rgb(self.path, size), 2, 0))
            return np.asarray(red * 4 + green / (1 << 6) + blue / (1 << 14), np.float32)
        kind = encoding(self.path)
        if kind == "pfm":
            return read_disparities(self.path, size)
        if kind.startswith("grey"):
            return read_levels(self.path, size).astype(np.float32)
        stored = read_map(self.path)
        if stored.shape[::-1] != size:
            width, height = stored.shape[::-1]
            raise UserError(f"ground truth {self.path} is {width}x{height} px, not {size[0]}x{size[1]} as its view")
        return stored


SeenKind = Literal["mask", "truth", "hidden"]


@frozen
class SeenFile:
    """Files that say which pixels of a view the other view of the pair sees.

    Parameters
    ----------
    kind
        ``mask``: 255 where it sees the point, as in Middlebury's ``mask0nocc.png``. ``truth``: 0 where it does not, as
        in KITTI's ``disp_noc``. ``hidden``: not 0 where it does not, in any of the files, as in Sintel's
        ``occlusions``.
    """

    paths: tuple[Path, ...]
    kind: SeenKind

    def read(self, size: tuple[int, int]) -> NDArray[np.bool_]:
        """(H, W) does the other view see the point?

        Raises
        ------
        UserError
            If a file cannot be read, or a mask has levels of no mask.
        """
        levels = [read_levels(path, size) for path in self.paths]
        if self.kind == "hidden":
            return np.asarray(np.all([level == 0 for level in levels], axis=0))
        if self.kind == "truth":
            return np.asarray(levels[0] > 0)
        if not set(np.unique(levels[0])) <= {0, 128, 255}:
            raise UserError(f"mask {self.paths[0]} has other levels than 0, 128 and 255: 255 is what both views see")
        return np.asarray(levels[0] == 255)


@frozen
class StoredScene:
    """Where the files of a scene lie and what is known about them. All real scenes are loaded through it.

    Parameters
    ----------
    called
        Its name, without options.
    views, labels
        Files from left to right, and what each is called; labels end in numbers that increase.
    disparities
        The range to search, pixels per view step. If None, it is from 0 to the nearest truth of any view, rounded
        up to a multiple of `ROUND_UP` pixels of the pair.
    truth
        View index -> its file.
    pair_steps
        View steps between the two views of the pair.
    positions
        Where each view was taken, in view steps, if these are uneven.
    seen
        View index -> which of its pixels the other view of the pair sees, where files say so.
    sparse
        Is truth known at scattered pixels only? If None, the truth itself tells (`matbench.regions.is_sparse`).
    size
        (width, height) in pixels that the images must have; None if it is not known beforehand.
    preferred
        Indices of the views to score rather than others, the best first. The others follow from the middle
        outwards, those with truth if any has.
    prefixes
        What may stand before a view's number where an option names it, as in ``views=im2+im6``.
    masks
        View index -> name of a region -> its mask, a grey image: the region is where it is not black. A name of the
        pair's regions takes the place of what is computed.
    border
        Px along the frame that its benchmark does not score. If there are any, region ``inner`` leaves them out, and so
        do the masks.
    metrics
        The set of metrics that its benchmark reports (`matbench.scene.Scene`).
    column
        The views were taken one below the other, from the top. Images and truth are turned counter-clockwise
        by a quarter, so that the views lie from left to right.
    """

    called: str
    views: tuple[Path, ...]
    labels: tuple[str, ...]
    disparities: Range | None
    truth: Mapping[int, TruthFile] = field(factory=dict)
    pair_steps: float = 1
    positions: tuple[float, ...] = ()
    seen: Mapping[int, SeenFile] = field(factory=dict)
    sparse: bool | None = None
    size: tuple[int, int] | None = None
    preferred: tuple[int, ...] = ()
    prefixes: tuple[str, ...] = ()
    masks: Mapping[int, Mapping[str, Path]] = field(factory=dict)
    border: int = 0
    metrics: str = ""
    column: bool = False

    def load(self, options: Mapping[str, str]) -> Scene:
        """Read the chosen views and their truth.

        Parameters
        ----------
        options
            `OPTIONS`; others belong to the dataset and are only named.

        Raises
        ------
        UserError
            For a value that an option does not take, and for missing or damaged files.
        """
        if self.positions and ("baseline" in options or options.get("views", "").isdecimal()):
            raise UserError(
                f"{self.called}: its views lie at uneven steps: name those that you want, "
                f"as views={self.labels[0]}+{self.labels[1]}, instead of their number or baseline"
            )
        chosen, ref = views_and_reference(self.called, self.labels, self._scorable(), options, self.prefixes)
        searched = search_range(self.called, options.get("disparities"), self.pair_steps)
        partner = self._partner(ref)

        images = {ref: read_rgb(self.views[ref], self.size)}
        height, width = images[ref].shape[:2]
        if len(self.views) * images[ref].nbytes > MOST_BYTES:
            raise UserError(
                f"{self.called} claims {len(self.views)} views of {width}x{height} px: "
                f"at most {MOST_BYTES >> 30} GiB of pixels are read"
            )
        images |= {index: read_rgb(self.views[index], (width, height)) for index in chosen if index != ref}
        kept = {view: file for view, file in self.truth.items() if view in images or self.disparities is None}
        truth = {view: file.read((width, height)) for view, file in kept.items()}
        known = self.disparities or searched or self._range_of(truth.values())
        seen = self.seen[ref].read((width, height)) if ref in self.seen and ref in truth else None
        sparse = ref in truth and (is_sparse(truth[ref]) if self.sparse is None else self.sparse)
        own = self._own_regions(ref, (width, height)) if ref in truth else {}
        if self.column:
            # column y of what is turned is row y of the picture: where nearer points move up from one
            # view to the next below it, they then move left
            images = {index: np.rot90(image) for index, image in images.items()}
            truth = {index: np.rot90(values) for index, values in truth.items()}
            seen = None if seen is None else np.rot90(seen)
            own = {name: np.rot90(mask) for name, mask in own.items()}

        views = np.zeros((len(self.views), *images[ref].shape), np.uint8)  # those not chosen are dropped below
        for index, image in images.items():
            views[index] = image
        full = Scene(
            name=spec.label(self.called, dict(sorted(options.items()))),
            views=views,
            labels=self.labels,
            ref=ref,
            disparities=searched or known,
            truth=truth,
            pair_steps=self.pair_steps,
            regions={**regions(images[ref], truth[ref], partner, seen, sparse), **own} if ref in truth else {},
            metrics=self.metrics,
            positions=self.positions,
            sparse=sparse,
        )
        return full if len(chosen) == len(self.labels) else full.choose(chosen)

    def _own_regions(self, ref: int, size: tuple[int, int]) -> dict[str, NDArray[np.bool_]]:
        """The regions of a view that come from masks, and the one without the border."""
        width, height = size
        inner = np.zeros((height, width), bool)
        inner[self.border : height - self.border, self.border : width - self.border] = True
        found = {name: (read_levels(path, size) > 0) & inner for name, path in self.masks.get(ref, {}).items()}
        return {**({"inner": inner} if self.border else {}), **found}

    def _scorable(self) -> list[int]:
        """Indices of the views that may be scored, the best first; see `preferred`."""
        middle = (len(self.views) - 1) / 2
        others = set(self.truth or range(len(self.views))) - set(self.preferred)
        return [*self.preferred, *sorted(others, key=lambda view: (abs(view - middle), view))]

    def _range_of(self, truths: Iterable[NDArray[np.float32]]) -> Range:
        """0 to the nearest truth, rounded up; see `disparities`."""
        found = [float(np.nanmax(truth)) for truth in truths]
        if not found:
            raise UserError(
                f"{self.called}: nothing says which disparities to search, as there is no ground truth: "
                "write disparities=0:192 after its name, in pixels of the pair"
            )
        nearest = max(found) * self.pair_steps
        return Range(0, max(1, ceil(nearest / ROUND_UP - 1e-6)) * ROUND_UP / self.pair_steps)

    def _partner(self, ref: int) -> float:
        """View steps from the reference view to the other one of the pair: to the right if there is one, else left."""
        places = self.positions or range(len(self.views))
        others = [place - places[ref] for place in places]
        for steps in (self.pair_steps, -self.pair_steps):
            if any(abs(other - steps) <= SAME_PLACE for other in others):
                return steps
        possible = sorted({abs(other) for other in others if other})
        raise UserError(
            f"{self.called}: no view lies {self.pair_steps:g} steps (pair_steps) from its reference view "
            f"{self.labels[ref]}: the others are {', '.join(f'{steps:g}' for steps in possible)} steps away"
        )

    def problems(self) -> list[str]:
        """Everything that is wrong with the files, one line each.

        Where the size is not known beforehand, the one that most views have is taken to be right.
        """
        found, sizes = [], {}
        for path in self.views:
            try:
                sizes[path] = read_size(path)
            except UserError as error:
                found.append(str(error))
        if not sizes:
            return found
        size = self.size or Counter(sizes.values()).most_common(1)[0][0]
        files: list[Callable[[], object]] = [partial(read_rgb, path, size) for path in sizes]
        files += [partial(file.read, size) for file in self.truth.values()]
        files += [partial(file.read, size) for file in self.seen.values()]
        files += [partial(read_levels, path, size) for masks in self.masks.values() for path in masks.values()]
        for read in files:
            try:
                read()
            except UserError as error:
                found.append(str(error))
        return found
