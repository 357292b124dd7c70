"""Evenly spaced cameras before a random world: what they see, exactly."""

from functools import cached_property

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.datasets.synthetic import casting, shading
from matbench.datasets.synthetic.materials import GRAIN, STARTS, library
from matbench.datasets.synthetic.random_worlds import Drawn
from matbench.datasets.synthetic.solids import Model
from matbench.datasets.synthetic.surfaces import Array


@frozen(eq=False, slots=False)
class Stage:
    """Pinhole cameras in a row before a world, which fills every picture but very tall ones.

    Camera j stands at X = (j - ref) * near / steps; the disparity of a point at depth Z is ``width * near / steps / Z``
    px per view step.

    Parameters
    ----------
    drawn
        The world.
    count, ref, steps
        How many cameras, the one at X = 0, and the view steps of the pair.
    width, height
        Size of a picture, px. The focal length is the width.
    lowered
        How far the picture of each camera lies too low, px.
    """

    drawn: Drawn
    count: int
    ref: int
    steps: int
    width: int
    height: int
    lowered: tuple[float, ...]
    _seen: dict[int, tuple[Array, NDArray[np.int64]]] = field(factory=dict, init=False)

    @cached_property
    def _model(self) -> Model:
        return Model.of(self.drawn.solids)

    @cached_property
    def _pictures(self) -> NDArray[np.int8]:
        return library([GRAIN, *(solid.skin.tile for solid in self.drawn.solids)])

    def disparity(self, depth: Array) -> Array:
        """Px per view step; NaN where a ray meets nothing and the depth is infinite."""
        disparity: Array = self.width * self.drawn.near / self.steps / depth
        return np.where(np.isfinite(depth), disparity, np.nan)

    def _eye(self, view: int) -> float:
        return (view - self.ref) * self.drawn.near / self.steps

    @property
    def _middle(self) -> float:
        return (self.width - 1) / 2

    def _top(self, view: int) -> float:
        """Row of the optical axis."""
        return (self.height - 1) / 2 + self.lowered[view]

    def _downs(self, view: int) -> Array:
        """Slopes down of the rays through the rows."""
        slopes: Array = (np.arange(self.height) - self._top(view)) / self.width
        return slopes

    def cast(self, view: int, fineness: int = 1) -> tuple[Array, NDArray[np.int64]]:
        """Depth and surface on the rays through samples 1 / fineness px apart, pixel centres included.

        Both are (H, fineness (W - 1) + 1).
        """
        columns = np.arange(fineness * (self.width - 1) + 1) / fineness
        rights, downs, eye = (columns - self._middle) / self.width, self._downs(view), self._eye(view)
        depth, index = np.empty((self.height, columns.size)), np.empty((self.height, columns.size), np.int64)
        model = self._model
        casting.depths(model.kinds, model.rows, model.windows(eye), eye, rights, downs, depth, index)
        return depth, index

    def depth(self, view: int, fineness: int = 1) -> Array:
        """(H, fineness (W - 1) + 1) depth."""
        return (self._pixels(view) if fineness == 1 else self.cast(view, fineness))[0]

    def _pixels(self, view: int) -> tuple[Array, NDArray[np.int64]]:
        """Depth and surface at the pixels' centres; kept, as truth and picture both need them."""
        if view not in self._seen:
            self._seen[view] = self.cast(view)
        return self._seen[view]

    def visible(self, view: int, depth: Array) -> NDArray[np.bool_]:
        """(n, H, W) bool: does view j see the point that `view` sees at the centre of a pixel?

        A ray is cast through the exact place of the point in view j.
        """
        found = np.ones((self.count, self.height, self.width), np.bool_)
        columns, disparity, model = np.arange(self.width, dtype=float), self.disparity(depth), self._model
        for other in range(self.count):
            if other != view:
                eye = self._eye(other)
                places = columns - (other - view) * disparity
                casting.seen(
                    model.kinds,
                    model.rows,
                    model.windows(eye),
                    eye,
                    self._middle,
                    float(self.width),
                    self._downs(view),
                    self.lowered[other] - self.lowered[view],
                    places,
                    depth,
                    found[other],
                )
        return found

    def pictures(self, view: int, highlight: float = 0.0) -> NDArray[np.float32]:
        """(2, H, W, 3) RGB grey levels, first without the highlight and then with it (`picture`)."""
        model, eye = self._model, self._eye(view)
        out = np.empty((2, self.height, self.width, 3), np.float32)
        shading.picture(
            model.kinds,
            model.rows,
            model.windows(eye),
            model.skins,
            self._pictures,
            STARTS,
            eye,
            self._middle,
            float(self.width),
            self._top(view),
            np.array([*self.drawn.light, highlight]),
            self._pixels(view)[1],
            out,
        )
        return out

    def picture(self, view: int, highlight: float = 0.0) -> NDArray[np.float32]:
        """(H, W, 3) RGB grey levels, `highlight` of them where a glossy surface reflects the light to the camera."""
        picture: NDArray[np.float32] = self.pictures(view, highlight)[1]
        return picture
