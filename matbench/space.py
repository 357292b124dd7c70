"""Disparity space: planes x rows x columns of target points, and volumes over it (docs/concepts/disparity-space.md)."""

from collections.abc import Mapping
from math import ceil, floor

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.scene import Range


@frozen
class DisparitySpace:
    """The target points of n views, each on a pixel ray of every view.

    Columns are counted in samples of 1/`fineness` pixel, so that plane k has the disparity
    ``k / fineness`` and every homologue is a whole number of samples: the point in column x of
    view 0 and plane k is at sample ``x - i * k`` of view i (equation 1 of the paper).

    Parameters
    ----------
    views, rows, width
        Number of views, rows and pixel columns of an image.
    first, last
        The farthest and the nearest plane; both may be negative.
    fineness
        q, samples per pixel and planes per pixel of view step.
    """

    views: int
    rows: int
    width: int
    first: int
    last: int
    fineness: int = 1

    @classmethod
    def covering(cls, disparities: Range, views: int, rows: int, width: int, fineness: int = 1) -> "DisparitySpace":
        """The space whose planes cover a range of disparities in pixels per view step."""
        slack = 1e-6  # a bound that is a plane but for rounding adds no plane
        first = floor(disparities.least * fineness + slack)
        last = ceil(disparities.largest * fineness - slack)
        return cls(views, rows, width, first, max(first, last), fineness)

    @property
    def planes(self) -> int:
        return self.last - self.first + 1

    @property
    def samples(self) -> int:
        """Samples of an image row: one on every pixel and fineness - 1 between two."""
        return self.fineness * (self.width - 1) + 1

    @property
    def origin(self) -> int:
        """Column of view 0, in samples, of the leftmost target points; never positive."""
        return min(0, (self.views - 1) * self.first)

    @property
    def columns(self) -> int:
        """Columns of the union of all frustums over all planes."""
        return self.samples + max(0, (self.views - 1) * self.last) - self.origin

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of a volume: (rows, planes, columns)."""
        return self.rows, self.planes, self.columns

    @property
    def disparities(self) -> NDArray[np.float32]:
        """(planes,) disparity of every plane, far to near, in pixels per view step."""
        return (np.arange(self.first, self.last + 1) / self.fineness).astype(np.float32)

    def start(self, view: int, plane: int) -> int:
        """Column, as an index of a volume, where sample 0 of `view` lies in plane index `plane`.

        The frustum of the view (equation 4) is the slice ``start : start + samples``.
        """
        return view * (self.first + plane) - self.origin

    def frustum(self, view: int, plane: int) -> slice:
        """The columns of plane index `plane` that `view` sees, one per sample."""
        start = self.start(view, plane)
        return slice(start, start + self.samples)

    def in_view(self, values: NDArray[np.generic], view: int) -> NDArray[np.generic]:
        """(rows, planes, width): the values of a volume at the whole pixels of one view."""
        out = np.empty((values.shape[0], self.planes, self.width), values.dtype)
        for plane in range(self.planes):
            out[:, plane] = values[:, plane, self.frustum(view, plane)][:, :: self.fineness]
        return out


@frozen(eq=False)
class Volume:
    """One number in [0, 1] for every target point.

    Parameters
    ----------
    space
        Its target points.
    values
        (rows, planes, columns) float32; plane 0 is the farthest.
    views
        Which of the scene's views the space spans, as indices of the scene, evenly spaced.
    """

    space: DisparitySpace
    values: NDArray[np.float32] = field()
    views: tuple[int, ...]

    def __attrs_post_init__(self) -> None:
        if self.values.shape != self.space.shape:
            raise ValueError(f"volume is {self.values.shape}, its space {self.space.shape}")
        if len(self.views) != self.space.views:
            raise ValueError(f"volume names {len(self.views)} views, its space has {self.space.views}")


def visibility(volume: Volume, view: int) -> NDArray[np.float32]:
    """Visibility of every target point in one view (docs/concepts/materiality.md, equation 3).

    V(s) = Fr(s) * product of (1 - materiality) over the nearer points on its ray, in one sweep
    from near to far.

    Parameters
    ----------
    volume
        Materialities.
    view
        Index among the views of the volume's space.

    Returns
    -------
    (rows, planes, columns) float32 in [0, 1]; 0 outside the view's frustum.
    """
    space, seen = volume.space, np.zeros_like(volume.values)
    through = np.ones((space.rows, space.samples), np.float32)
    for plane in reversed(range(space.planes)):
        ray = space.frustum(view, plane)
        seen[:, plane, ray] = through
        through *= 1 - volume.values[:, plane, ray]
    return seen


def surface(space: DisparitySpace, maps: Mapping[int, NDArray[np.float32]], views: tuple[int, ...]) -> Volume:
    """The materialities of known surfaces: 1 in the plane nearest to what a ray meets first, else 0.

    Every view with a map marks one target point on each of its rays, so that what several views
    see is marked by each; a slanted surface is as thick as its rays disagree. What no view sees is
    not marked.

    Parameters
    ----------
    maps
        View of the space -> (rows, samples) disparities at its samples, pixels per view step of
        the space; NaN and what lies beyond the planes marks nothing.
    views
        Which of the scene's views the space spans.
    """
    values = np.zeros(space.shape, np.float32)
    for view, disparity in maps.items():
        plane = np.round(disparity.astype(np.float64) * space.fineness) - space.first
        rows, samples = np.nonzero((plane >= 0) & (plane < space.planes))
        planes = plane[rows, samples].astype(np.intp)
        values[rows, planes, samples + view * (space.first + planes) - space.origin] = 1
    return Volume(space, values, views)
