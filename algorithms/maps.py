"""Ready-made disparity maps: whatever wrote them, they stand in the table like a method's."""

import csv
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import ClassVar, Literal, get_args

import numpy as np
from attrs import Attribute, field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.errors import UserError
from matbench.files.images import read_bytes
from matbench.files.maps import Reading, read_map
from matbench.scene import Scene
from matbench.scenes.ready_maps import find, names

Unit = Literal["pair", "step"]
Crop = Literal["none", "centre"]


def _is_folder(_: object, __: "Attribute[str]", folder: str) -> None:
    if not Path(folder).is_dir():
        raise ValueError(f"folder {folder!r} does not exist: give the folder that holds the maps")


@frozen
class Maps:
    """Ready-made disparity maps, read from a folder: one for each scene, and for further views if they are there.

    A map is found by the scene's name, with or without its dataset: ``teddy.pfm``, ``middlebury2003/teddy.png``,
    ``teddy/2.npy`` or ``teddy_2.pfm`` for the view 2, ``teddy/disp0.pfm``. Nothing is resized or filled.
    disparity = sign * stored / scale.

    Reading a file says nothing about the time of the method that wrote it. So the cell has no time, unless `seconds`
    or `times` says it; a time that was measured elsewhere is shown, but not ranked.

    Parameters
    ----------
    folder
        Where the maps are. A changed map is another cell; the others stay.
    pattern
        Their names, if they are not found: ``{scene}`` and ``{view}`` stand for the scene's name and the view's label,
        as in ``{scene}/final_{view}.png``.
    unit
        What one pixel of disparity is measured between: ``pair``, the two views of the field's pair, or ``step``, views
        next to one another.
    scale
        The stored number of one pixel: 256 for KITTI, 16 for OpenCV's, 4 for the PNGs of a quarter-size Middlebury
        scene.
    sign
        -1 if what is nearer has the smaller number.
    unknown
        The stored number of no answer, besides NaN and infinities; 0 in KITTI's.
    crop
        What to do with a map that is smaller than its view: ``none`` refuses it; ``centre`` puts it in the middle, with
        no answer around it.
    seconds
        What the method took for each map.
    times
        A CSV file with columns ``scene`` and ``seconds``, instead of `seconds`.
    """

    uneven: ClassVar[bool] = True

    folder: str = field(validator=_is_folder)
    pattern: str = ""
    unit: Unit = field(default="pair", validator=validators.in_(get_args(Unit)))
    scale: float = field(default=1.0, validator=validators.gt(0))
    sign: int = field(default=1, validator=validators.in_((1, -1)))
    unknown: float | None = None
    crop: Crop = field(default="none", validator=validators.in_(get_args(Crop)))
    seconds: float | None = field(default=None, validator=validators.optional(validators.ge(0)))
    times: Path | None = None

    def reads_for(self, scene: Scene) -> Sequence[Path]:
        """The maps of a scene. Where there are none, that is told when the scene is solved."""
        try:
            return list(find(Path(self.folder), scene, self.pattern).values())
        except UserError:
            return []

    def solve(self, scene: Scene, context: Context) -> Estimate:  # noqa: ARG002 (nothing to compute)
        """The maps as they are stored, in pixels per view step.

        Raises
        ------
        UserError
            If there is none of the reference view, or one cannot be read or is of another size.
        """
        files = find(Path(self.folder), scene, self.pattern)
        size = scene.height, scene.width
        maps = {view: self._read(file, size, scene.pair_steps) for view, file in files.items()}
        return Estimate(maps, work={"maps": len(maps)}, seconds=self._took(scene))

    def _read(self, file: Path, size: tuple[int, int], pair_steps: float) -> NDArray[np.float32]:
        values = Reading(self.scale, self.sign, self.unit, self.unknown).disparities(read_map(file), pair_steps)
        values /= np.float32(pair_steps)
        if values.shape == size:
            return values
        (height, width), (rows, columns) = size, values.shape
        told = f"map {file} is {columns}x{rows} px, its view {width}x{height}"
        if rows > height or columns > width:
            raise UserError(f"{told}: a map of the very same pixels is needed")
        if self.crop == "none":
            raise UserError(f"{told}: give the whole map, or crop=centre if its borders were cut off evenly")
        top, left = (height - rows) // 2, (width - columns) // 2
        whole = np.full(size, np.nan, np.float32)
        whole[top : top + rows, left : left + columns] = values
        return whole

    def _took(self, scene: Scene) -> float | None:
        if self.times is None:
            return self.seconds
        text = read_bytes(self.times, "times").decode("utf-8-sig", "replace")
        rows = list(csv.DictReader(text.splitlines()))
        if not rows or not {"scene", "seconds"} <= set(rows[0]):
            raise UserError(f"times {self.times} need the columns scene and seconds")
        for row in rows:
            if row["scene"] in names(scene):
                try:
                    took = float(row["seconds"])
                except (TypeError, ValueError):
                    took = float("nan")
                if not (isfinite(took) and took >= 0):
                    raise UserError(f"times {self.times}: {row['seconds']!r} of {row['scene']} is no number of seconds")
                return took
        return None
