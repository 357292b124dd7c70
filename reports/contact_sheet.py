"""A scene at a glance, as one picture: its views, one row of pixels in all of them, its truth, its regions."""

import io
from collections.abc import Iterable, Sequence
from math import ceil
from typing import Any

import cv2
import numpy as np
from attrs import define, evolve, field, frozen
from numpy.typing import NDArray

from matbench import drawing
from matbench.recording.coloring import (
    DISPARITY,
    ERROR,
    UNKNOWN,
    Picture,
    colors,
    disparity_ends,
    palette,
    truth_colors,
)
from matbench.scene import Scene
from matbench.scenes.photo_consistency import left_over

WIDTH = 1800  # px
SHOWN = 15  # views and truth maps at most; of more, an even choice

_MARGIN, _GAP, _CAPTION, _HEADING = 44, 14, 26, 62
_BACKGROUND, _INK, _SOFT = (24, 26, 30), "#f2f2ee", "#a9adb5"
_ACCENT = (255, 209, 64)
_DIM = 0.4  # of the brightness, outside a region
_TINT = 0.72  # of a region's colour
_WORST = 32  # grey levels left by warping: from here on the last colour
_REGION_COLORS = ((0, 158, 115), (86, 180, 233), (230, 159, 0), (213, 94, 0), (204, 121, 167), (240, 228, 66))


@frozen(eq=False)
class Tile:
    """A picture with its caption; the reference view's is framed."""

    picture: Picture
    caption: str
    is_framed: bool = False


@define(eq=False)
class _Sheet:
    """Collects pictures and texts from the top down. They are drawn at the end, when the height is known."""

    pictures: list[tuple[int, int, Picture]] = field(factory=list)
    texts: list[tuple[int, int, str, dict[str, Any]]] = field(factory=list)
    y: int = _MARGIN

    def text(self, x: int, y: int, words: str, **style: Any) -> None:
        self.texts.append((x, y, words, style))

    def heading(self, words: str, aside: str = "") -> None:
        self.y += _HEADING - 22
        self.text(_MARGIN, self.y, words, size=17, color=_INK, weight="bold")
        if aside:
            self.text(WIDTH - _MARGIN, self.y, aside, size=13, color=_SOFT, ha="right")
        self.y += 16

    def tiles(self, tiles: Sequence[Tile], columns: int, exact: bool) -> None:
        """Place tiles in rows, all of one size. `exact` keeps hard pixels when they are enlarged, as for maps."""
        width = (WIDTH - 2 * _MARGIN - (columns - 1) * _GAP) // columns
        height, broad = tiles[0].picture.shape[:2]
        width = min(width, 2 * broad)
        tall = max(1, round(width * height / broad))
        for first in range(0, len(tiles), columns):
            for place, tile in enumerate(tiles[first : first + columns]):
                x = _MARGIN + place * (width + _GAP)
                picture = _resized(tile.picture, width, tall, exact)
                self.pictures.append((x, self.y, _framed(picture) if tile.is_framed else picture))
                color = "#%02x%02x%02x" % _ACCENT if tile.is_framed else _SOFT  # noqa: UP031
                self.text(x, self.y + tall + 18, tile.caption, size=13, color=color)
            self.y += tall + _CAPTION + _GAP

    def png(self) -> bytes:
        height = self.y + _MARGIN - _GAP
        canvas = np.full((height, WIDTH, 3), _BACKGROUND, np.uint8)
        for x, y, picture in self.pictures:
            canvas[y : y + picture.shape[0], x : x + picture.shape[1]] = picture
        out = io.BytesIO()
        with drawing.style():
            from matplotlib.figure import Figure

            figure = Figure(figsize=(WIDTH / 100, height / 100), dpi=100)
            figure.figimage(canvas, 0, 0)
            for x, y, words, style in self.texts:
                looks = {**style, "size": 0.72 * style["size"]}  # px to points at 100 dots an inch
                figure.text(x / WIDTH, 1 - y / height, words, parse_math=False, va="baseline", **looks)
            figure.savefig(out, format="png", metadata={"Software": None})
        return out.getvalue()


def contact_sheet(scene: Scene, row: int | None = None) -> bytes:
    """Draw the contact sheet of a scene.

    Parameters
    ----------
    row
        The row of pixels that is shown in all views; the middle one if not given.

    Returns
    -------
    A PNG file, `WIDTH` px wide.
    """
    row = scene.height // 2 if row is None else row
    sheet = _Sheet()
    sheet.y += 20
    sheet.text(_MARGIN, sheet.y, scene.name, size=28, color=_INK, weight="bold")
    sheet.y += 32
    sheet.text(_MARGIN, sheet.y, _facts(scene), size=14.5, color=_SOFT)

    shown = _spread(range(scene.n), scene.ref)
    views = [Tile(_marked(scene, view, row), _view_caption(scene, view), view == scene.ref) for view in shown]
    sheet.heading("Views", "" if len(shown) == scene.n else f"{len(shown)} of {scene.n}")
    sheet.tiles(views, _columns(len(views)), exact=False)

    sheet.heading(f"Row {row} in all views", "nearer points move further to the left from view to view, top to bottom")
    _strips(sheet, scene, row)

    if scene.truth:
        least, largest = ends = disparity_ends(scene)
        known = _spread(sorted(scene.truth), scene.ref)
        maps = []
        for view in known:
            colored = truth_colors(scene.truth[view], ends)
            maps.append(Tile(colored, _truth_caption(scene, view), view == scene.ref))
            if len(known) <= 2:
                maps.append(_left_over(scene, view))
        sheet.heading("Truth")
        _color_bar(sheet, least, largest)
        sheet.tiles(maps, max(_columns(len(maps)), 4), exact=True)
    if scene.scored_regions:
        sheet.heading(f"Regions of view {scene.labels[scene.ref]}", "in colour: what belongs to the region")
        tiles = [
            Tile(_region(scene, mask, _REGION_COLORS[k % len(_REGION_COLORS)]), f"{name}  {100 * mask.mean():.1f} %")
            for k, (name, mask) in enumerate(scene.scored_regions.items())
        ]
        sheet.tiles(tiles, max(_columns(len(tiles)), 4), exact=False)
    return sheet.png()


def _facts(scene: Scene) -> str:
    near = "neighbouring views" if scene.pair_steps == 1 else f"views {scene.pair_steps:g} steps apart"
    truth = "no truth" if not scene.truth else f"truth of {len(scene.truth)} view{'s' if len(scene.truth) > 1 else ''}"
    return "   ·   ".join(
        (
            f"{scene.n} views of {scene.width} × {scene.height} px",
            f"disparities {scene.disparities} px per view step",
            truth,
            f"errors in px between {near}",
        )
    )


def _view_caption(scene: Scene, view: int) -> str:
    return f"{scene.labels[view]}  reference view" if view == scene.ref else scene.labels[view]


def _truth_caption(scene: Scene, view: int) -> str:
    truth = scene.truth[view]
    known = np.isfinite(truth)
    if not known.any():
        return f"{scene.labels[view]}  unknown"
    unknown = "" if known.all() else f", {100 * (1 - known.mean()):.1f} % unknown"
    return f"{scene.labels[view]}  {np.nanmin(truth):.4g} .. {np.nanmax(truth):.4g} px per view step{unknown}"


def _left_over(scene: Scene, view: int) -> Tile:
    """The difference that remains when views are warped by the truth: noise, mirrors, errors of the truth."""
    difference = left_over(evolve(scene, ref=view, regions={}))
    picture = colors(difference, (0, _WORST), ERROR)
    picture[~np.isfinite(difference)] = UNKNOWN
    mean = f"{np.nanmean(difference):.1f}" if np.isfinite(difference).any() else "no"
    return Tile(picture, f"left by warping: {mean} grey levels (pale: {_WORST}+)")


def _spread(views: Iterable[int], ref: int) -> list[int]:
    """At most `SHOWN` of the views, evenly chosen; the reference view stays if it is one of them."""
    every = list(views)
    if len(every) <= SHOWN:
        return every
    chosen = {every[k] for k in np.linspace(0, len(every) - 1, SHOWN - 1).round().astype(int)}
    return sorted(chosen | ({ref} & set(every)))


def _columns(count: int) -> int:
    rows = ceil(count / 5) if count <= 10 else ceil(count / 6)
    return max(3, ceil(count / rows))


def _resized(picture: Picture, width: int, height: int, exact: bool) -> Picture:
    is_smaller = width < picture.shape[1]
    enlarge = cv2.INTER_NEAREST if exact else cv2.INTER_CUBIC
    made = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA if is_smaller else enlarge)
    return np.asarray(made, np.uint8)


def _framed(picture: Picture, thick: int = 3) -> Picture:
    framed = picture.copy()
    framed[:thick] = framed[-thick:] = _ACCENT
    framed[:, :thick] = framed[:, -thick:] = _ACCENT
    return framed


def _marked(scene: Scene, view: int, row: int) -> Picture:
    """A view; in the reference view, both ends of the row that is shown below are marked."""
    marked: Picture = scene.views[view].copy()
    if view != scene.ref:
        return marked
    half, length = max(1, scene.height // 250), scene.width // 24
    for columns in (slice(0, length), slice(scene.width - length, scene.width)):
        marked[max(0, row - half) : row + half + 1, columns] = _ACCENT
    return marked


def _strips(sheet: _Sheet, scene: Scene, row: int) -> None:
    """One row of pixels of every view, as thick strips below each other."""
    width = WIDTH - 2 * _MARGIN
    shown = _spread(range(scene.n), scene.ref)
    strips = np.repeat(scene.views[shown, row], min(40, 200 // len(shown)), axis=0)
    sheet.pictures.append((_MARGIN, sheet.y, _resized(strips, width, len(strips), exact=False)))
    sheet.y += len(strips) + _GAP


def _color_bar(sheet: _Sheet, least: float, largest: float) -> None:
    wide, tall = 260, 14
    x, y = WIDTH - _MARGIN - wide - 230, sheet.y - 28
    bar: NDArray[np.uint8] = np.repeat(palette(DISPARITY, wide)[None], tall, axis=0)
    sheet.pictures.append((x, y, bar))
    sheet.pictures.append((WIDTH - _MARGIN - tall - 70, y, np.full((tall, tall, 3), UNKNOWN, np.uint8)))
    style: dict[str, Any] = {"size": 13, "color": _SOFT}
    sheet.text(x - 8, y + 12, f"far  {least:.4g}", ha="right", **style)
    sheet.text(x + wide + 8, y + 12, f"{largest:.4g}  near", **style)
    sheet.text(WIDTH - _MARGIN, y + 12, "unknown", ha="right", **style)


def _region(scene: Scene, mask: NDArray[np.bool_], color: tuple[int, int, int]) -> Picture:
    """The reference view in dark grey, with the region in colour."""
    grey = scene.views[scene.ref].astype(np.float32).mean(axis=2, keepdims=True)
    inside = (1 - _TINT) * grey + _TINT * np.array(color, np.float32)
    picture: Picture = np.rint(np.where(mask[..., None], inside, _DIM * grey)).astype(np.uint8)
    return picture
