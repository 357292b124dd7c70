"""Folders that hold many pairs, one for each frame, as KITTI, MPI Sintel and SceneFlow lay them out.

A scene is named by the folder and its frame, ``kitti/training[frame=000000_10]``: the path of the left view below the
folder of left views, without its ending. What truth and masks are called, and how they store their numbers:

- KITTI 2015 and 2012: 16 bits, 256 for one pixel, 0 for unknown, sparse. ``disp_noc`` is the truth of those points
  only that both views see (readme of the development kit). In 2015, ``disp_occ_1`` belongs to the next frame.
- MPI Sintel: disparities in three channels (`TruthFile.packed`). ``occlusions`` and ``outofframe`` say what the right
  view does not see.
- SceneFlow (FlyingThings3D, Monkaa, Driving): PFM, dense.

Nothing states a range, so that it comes from the truth, unless the option `disparities` gives it.
"""

import os
import shlex
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from itertools import islice
from pathlib import Path

from attrs import evolve, field, frozen

from matbench.datasets.stored import SeenFile, SeenKind, StoredScene, TruthFile, image_file, inside
from matbench.errors import UserError

FRAME, PASS = "frame", "pass"
"""Options: which frame, and which of several renderings."""

_PASSES = ("clean", "final")
_SHOWN, _LOOKED_AT = 3, 10_000  # frames that a message names, and files that are looked at to find them
_SEQUENCE, _NUMBER, _RENDERED = "{sequence}", "{number}", "{pass}"


@frozen
class Layout:
    """Where a dataset puts its files, without endings.

    Parameters
    ----------
    left, right, truth
        Patterns: ``{sequence}/{number}`` is the frame, ``{pass}`` the rendering.
    stored
        How its truth is stored; the path is put in.
    seen
        Patterns of the files that say what the right view sees.
    kind
        What these hold.
    sparse
        Is its truth sparse?
    metrics
        The set of metrics that its benchmark reports, if it has one.
    ending
        Of the files of truth.
    """

    name: str
    left: str
    right: str
    truth: str
    stored: TruthFile
    ending: str = ".png"
    seen: tuple[str, ...] = ()
    kind: SeenKind = "hidden"
    sparse: bool = field(default=False, kw_only=True)
    metrics: str = field(default="", kw_only=True)

    @staticmethod
    def named(pattern: str, frame: str, rendered: str) -> str:
        """A pattern for a frame; frames of a folder without sequences have no slash."""
        sequence, _, number = frame.rpartition("/")
        found = pattern.replace(_SEQUENCE, sequence) if sequence else pattern.replace(f"{_SEQUENCE}/", "")
        return found.replace(_NUMBER, number).replace(_RENDERED, rendered)


_KITTI = TruthFile(Path(), scale=256, unknown=0)
_FRAME = f"{_SEQUENCE}/{_NUMBER}"
LAYOUTS = (
    *(
        Layout(
            f"KITTI {year}",
            f"{left}/{_FRAME}",
            f"{right}/{_FRAME}",
            f"{occ}/{_FRAME}",
            _KITTI,
            seen=(f"{noc}/{_FRAME}",),
            kind="truth",
            sparse=True,
            metrics="kitti",
        )
        for year, left, right, occ, noc in (
            (2015, "image_2", "image_3", "disp_occ_0", "disp_noc_0"),
            (2012, "colored_0", "colored_1", "disp_occ", "disp_noc"),
            (2012, "image_0", "image_1", "disp_occ", "disp_noc"),
        )
    ),
    Layout(
        "MPI Sintel",
        f"{_RENDERED}_left/{_FRAME}",
        f"{_RENDERED}_right/{_FRAME}",
        f"disparities/{_FRAME}",
        TruthFile(Path(), packed=True),
        seen=(f"occlusions/{_FRAME}", f"outofframe/{_FRAME}"),
    ),
    Layout(
        "SceneFlow",
        f"frames_{_RENDERED}pass/{_SEQUENCE}/left/{_NUMBER}",
        f"frames_{_RENDERED}pass/{_SEQUENCE}/right/{_NUMBER}",
        f"disparity/{_SEQUENCE}/left/{_NUMBER}",
        TruthFile(Path()),
        ".pfm",
    ),
)


def sequences_in(called: str) -> bool:
    """Does a folder hold pairs in one of the layouts?"""
    return bool(_layouts(Path(called)))


def sequence(called: str, folder: Path, options: Mapping[str, str]) -> StoredScene:
    """The pair of the frame that the options name; of a folder with one frame, that one.

    Raises
    ------
    UserError
        If there is no such frame, or several and none is named.
    """
    layout, rendered = _chosen(called, folder, options)
    frame = options.get(FRAME)
    if frame is None:
        found = list(islice(_frames(folder, layout, rendered), 2))
        if len(found) != 1:
            raise _which(called, folder, layout, rendered, "")
        frame = found[0]

    def file(pattern: str, ending: str) -> Path:
        return inside(folder, layout.named(pattern, frame, rendered) + ending)

    sides = [layout.named(side, frame, rendered) for side in (layout.left, layout.right)]
    views = [inside(folder, str(image_file(folder, side).relative_to(folder))) for side in sides]
    if ".." in frame.split("/") or not views[0].is_file():
        raise _which(called, folder, layout, rendered, frame)
    truth = file(layout.truth, layout.ending)
    seen = tuple(path for one in layout.seen if (path := file(one, ".png")).is_file())
    return StoredScene(
        called,
        tuple(views),
        ("0", "1"),
        None,
        {0: evolve(layout.stored, path=truth)} if truth.is_file() else {},
        seen={0: SeenFile(seen, layout.kind)} if seen else {},
        sparse=layout.sparse,
        metrics=layout.metrics,
    )


def matching(called: str, options: Mapping[str, str]) -> list[str]:
    """The frames that the pattern in the options means, such as ``frame=*_10``; those with truth if any has.

    Raises
    ------
    UserError
        If it means none.
    """
    folder, pattern = Path(called), options[FRAME]
    layout, rendered = _chosen(called, folder, options)
    found = [frame for frame in _frames(folder, layout, rendered) if fnmatchcase(frame, pattern)]
    if not found:
        raise _which(called, folder, layout, rendered, pattern)
    return found


def _layouts(folder: Path) -> list[tuple[Layout, str]]:
    """The layouts that a folder has, with the renderings of each."""
    found = []
    for layout in LAYOUTS:
        for rendered in _PASSES if _RENDERED in layout.left else ("",):
            sides = [one.partition("/")[0].replace(_RENDERED, rendered) for one in (layout.left, layout.right)]
            if all(os.path.isdir(os.path.join(folder, side)) for side in sides):  # noqa: PTH112, PTH118
                found.append((layout, rendered))
    return found


def _chosen(called: str, folder: Path, options: Mapping[str, str]) -> tuple[Layout, str]:
    found, wanted = _layouts(folder), options.get(PASS)
    for layout, rendered in found:
        if wanted in (None, rendered):
            return layout, rendered
    possible = ", ".join(rendered for _, rendered in found if rendered)
    raise UserError(
        f"{PASS}={wanted} of {called}: {f'{possible} is possible' if possible else 'it has one rendering only'}"
    )


def _frames(folder: Path, layout: Layout, rendered: str) -> Iterator[str]:
    """Frames of a folder that have truth, all if none has; in order, as far as they are found soon."""
    above, _, below = layout.left.replace(_RENDERED, rendered).partition(f"/{_SEQUENCE}/")
    side = below.rpartition("/")[0]  # the last folder in each sequence, if there is one
    has_truth = (folder / layout.truth.partition("/")[0]).is_dir()
    looked = 0
    for place, folders, files in os.walk(folder / above):
        folders.sort()
        sequence = Path(place).relative_to(folder / above)
        if side and sequence.name != side:
            continue
        for name in sorted(files):
            looked += 1
            if looked > _LOOKED_AT:
                return
            frame = ((sequence.parent if side else sequence) / Path(name).stem).as_posix()
            if not has_truth or (folder / (layout.named(layout.truth, frame, rendered) + layout.ending)).is_file():
                yield frame


def _which(called: str, folder: Path, layout: Layout, rendered: str, frame: str) -> UserError:
    """The error that names some frames."""
    some = list(islice(_frames(folder, layout, rendered), _SHOWN))
    top = layout.left.partition("/")[0].replace(_RENDERED, rendered)
    top = layout.left.partition("/")[0].replace(_RENDERED, rendered)
    if not some:
        return UserError(f"{called} is laid out as {layout.name}, but has no frames in {top}")
    said = f"{called} has no {FRAME} {frame!r}" if frame else f"{called} holds many pairs of {layout.name}"
    listed = ", ".join([*some, "..."] if len(some) == _SHOWN else some)
    return UserError(f"{said}: name one, as {shlex.quote(f'{called}[{FRAME}={some[0]}]')}; frames: {listed}")
