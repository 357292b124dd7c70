"""Volumes as a run stores them: rounded to 256 levels, and read along the rays of a view."""

from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path

import numpy as np
from attrs import astuple, field, fields, frozen
from numpy.typing import NDArray

from matbench.files.arrays import opened_arrays
from matbench.scene import Scene
from matbench.space import DisparitySpace, Volume

_LEVELS = 255
_MOST_VIEWS, _FINEST = 1000, 16


@frozen(eq=False)
class StoredVolume:
    """A volume rounded to 255ths.

    Parameters
    ----------
    space
        Its target points.
    levels
        (rows, planes, columns) uint8; 255 is 1.
    views
        Which of the scene's views the space spans.
    """

    space: DisparitySpace
    levels: NDArray[np.uint8] = field()
    views: tuple[int, ...]

    def __attrs_post_init__(self) -> None:
        if self.levels.shape != self.space.shape or self.levels.dtype != np.uint8:
            raise ValueError(f"levels are {self.levels.shape} {self.levels.dtype}, not {self.space.shape} uint8")
        steps = set(np.diff(self.views).tolist())
        if len(self.views) != self.space.views or len(steps) != 1 or min(steps) < 1 or self.views[0] < 0:
            raise ValueError(f"volume spans the views {self.views}, not {self.space.views} evenly spaced ones")

    @classmethod
    def of(cls, volume: Volume) -> "StoredVolume":
        """Round a volume, a row at a time.

        Raises
        ------
        ValueError
            If it holds anything but numbers from 0 to 1.
        """
        if np.ma.is_masked(volume.values):
            raise ValueError("the volume has masked points, which are no numbers")
        levels = np.empty(volume.values.shape, np.uint8)
        for row, values in zip(levels, volume.values, strict=True):
            if not ((values >= -_ROUNDING) & (values <= 1 + _ROUNDING)).all():
                raise ValueError("the volume holds other things than numbers from 0 to 1")
            row[:] = np.round(values * np.float32(_LEVELS)).clip(0, _LEVELS)
        return cls(volume.space, levels, tuple(int(view) for view in volume.views))

    def write(self, path: Path) -> None:
        """Write it as ``.npz``, compressed."""
        space = np.array(astuple(self.space), np.int64)
        np.savez_compressed(path, levels=self.levels, space=space, views=np.array(self.views, np.int64))

    @classmethod
    def read(cls, path: Path, scene: Scene | None = None) -> "StoredVolume":
        """Read what `write` wrote. It is not unpacked unless it can be right.

        Parameters
        ----------
        scene
            What it must be a volume of, if that is known (`check_space`).

        Raises
        ------
        ValueError, OSError
            If it is missing, damaged, or holds something else.
        """
        with opened_arrays(path) as arrays:
            claims = arrays.claims
            known = {name: claims[name].shape if name in claims else () for name in ("space", "views")}
            if known["space"] != (len(fields(DisparitySpace)),) or not 0 < np.prod(known["views"]) <= _MOST_VIEWS:
                raise ValueError(f"{path} holds no volume")
            numbers, views = (arrays.read(name).astype(np.int64).ravel().tolist() for name in known)
            space = DisparitySpace(*numbers)
            if min(space.views - 1, space.rows, space.width, space.planes, space.fineness) < 1:
                raise ValueError(f"{path} holds no volume: {space} has no points")
            if scene is not None:
                check_space(space, tuple(views), scene)
            if "levels" not in claims or claims["levels"].shape != space.shape or claims["levels"].dtype != np.uint8:
                raise ValueError(f"{path} holds no levels of {space}")
            return cls(space, arrays.read("levels"), tuple(views))

    def rays(self, view: int) -> NDArray[np.uint8]:
        """(rows, planes, width) levels along the rays of one view of the scene, far to near.

        Raises
        ------
        ValueError
            If the volume does not span that view.
        """
        return self.space.in_view(self.levels, self.views.index(view)).astype(np.uint8, copy=False)

    def true_planes(self, scene: Scene) -> NDArray[np.float64]:
        """(H, W) plane index of the reference view's true disparity, fractional; NaN where it is unknown."""
        step = self.views[1] - self.views[0]
        truth = scene.truth[scene.ref].astype(np.float64)
        return truth * (step * self.space.fineness) - self.space.first


_ROUNDING = 1e-4


def check_space(space: DisparitySpace, views: tuple[int, ...], scene: Scene) -> None:
    """Raise ValueError if a volume's space is none of a scene, or much larger than what is searched there.

    A space with many planes is large before any of its points is known, and packs to next to nothing.
    """
    step = views[1] - views[0] if len(views) > 1 else 1
    searched = (scene.disparities.largest - scene.disparities.least) * step * space.fineness
    if (space.rows, space.width) != (scene.height, scene.width) or not (min(views) >= 0 and max(views) < scene.n):
        raise ValueError(f"the volume spans the views {views} of {space}, which is another scene")
    if space.fineness > _FINEST or space.planes > 2 * searched + 8 * space.fineness:
        raise ValueError(f"{space} has {space.planes} planes of 1/{space.fineness} px: more than the scene has use for")


@frozen(eq=False)
class Rays:
    """What a volume holds along the rays of some pixels, and where the surface truly is.

    Parameters
    ----------
    materiality
        (rays, planes) float32 from 0 to 1, plane 0 the farthest.
    surface
        (rays,) float64 plane index of the true surface, fractional.
    """

    materiality: NDArray[np.float32]
    surface: NDArray[np.float64]

    @cached_property
    def before_surface(self) -> NDArray[np.float64]:
        """(rays, planes) how far each point lies in front of the true surface, in planes; negative behind it."""
        places: NDArray[np.float64] = np.arange(self.materiality.shape[1]) - self.surface[:, None]
        return places


def rays_of(stored: StoredVolume, scene: Scene, masks: Iterable[NDArray[np.bool_]]) -> Iterator[Rays]:
    """For each region, the rays of the reference view's pixels with known truth."""
    surface = stored.true_planes(scene)
    levels = np.ascontiguousarray(stored.rays(scene.ref).transpose(0, 2, 1))
    for mask in masks:
        chosen = mask & np.isfinite(surface)
        yield Rays(levels[chosen] * np.float32(1 / _LEVELS), surface[chosen])
