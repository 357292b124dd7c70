"""The geometry of a scene's surface in perspective: points, planes of constant disparity, and pixel rays.

Nothing here depends on the viewer.
"""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.recording.coloring import disparity_ends
from matbench.recording.reduction import step_within
from matbench.scene import Scene

DEEPEST = 6.0  # largest ratio of farthest to nearest depth: with more, near things would crowd together

Point = tuple[float, float, float]
Eye = tuple[Point, Point]  # position and target


@frozen(eq=False)
class Perspective:
    """Where disparities lie in space, up to scale; x right, y down, z away from the camera.

    Depth is focal length times baseline over disparity. Here it is ``z = (nearest + offset) / (d + offset)``:
    the nearest disparity shown has depth 1. Focal length and baseline are unknown. The focal length is drawn
    as the image's width, and the baseline follows from the depths.

    With offset 0 this is true perspective. A disparity near 0 or below has infinite or no depth. Then the
    offset is the least that makes the farthest depth `DEEPEST`. Planes stay planes, as adding a constant to
    every disparity is a projective map.

    Parameters
    ----------
    ends
        The farthest and the nearest disparity shown: those of the truth, else of the range.
    """

    scene: Scene
    ends: tuple[float, float]
    offset: float

    @classmethod
    def of(cls, scene: Scene) -> "Perspective":
        least, largest = disparity_ends(scene)
        offset = max(0.0, (largest - DEEPEST * least) / (DEEPEST - 1))
        return cls(scene, (least, largest), offset if least + offset > 0 else 1.0 - least)

    @property
    def is_true(self) -> bool:
        """Is depth inverse to disparity itself, nothing added?"""
        return self.offset == 0

    @property
    def baseline(self) -> float:
        """The distance between neighbouring views."""
        return (self.ends[1] + self.offset) / self.scene.width

    def depth(self, disparity: float) -> float:
        """The depth of a disparity, at most twice that of the farthest end: outliers stay in sight."""
        return float(self.depths(np.array(disparity, np.float64)))

    def depths(self, disparity: NDArray[np.floating]) -> NDArray[np.float64]:
        """The depths of many disparities, as `depth`."""
        near, far = self.ends[1] + self.offset, self.ends[0] + self.offset
        depths: NDArray[np.float64] = near / np.maximum(disparity.astype(np.float64) + self.offset, far / 2)
        return depths

    def surface(
        self, disparity: NDArray[np.float32], limit: int
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.float32]]:
        """Points (N, 3), colours (N, 3) and radii (N,) of a reference view's map, one for each finite pixel.

        Of more than `limit` pixels, every k-th row and column. A point is as large as the gap to its neighbours.
        """
        scene, picture = self.scene, self.scene.views[self.scene.ref]
        step = step_within(disparity.shape[0], disparity.shape[1], limit)
        y, x = step * np.stack(np.nonzero(np.isfinite(disparity[::step, ::step])))
        d = disparity[y, x]
        depth = self.depths(d)
        across, down = (x - (scene.width - 1) / 2) / scene.width, (y - (scene.height - 1) / 2) / scene.width
        points = np.stack([across * depth, down * depth, depth], axis=1).astype(np.float32)
        return points, picture[y, x], (0.9 * step * depth / scene.width).astype(np.float32)

    def plane(self, disparity: float) -> list[Point]:
        """The closed outline of what the reference view sees of the plane of one disparity."""
        z = self.depth(disparity)
        x, y = z / 2, z * self.scene.height / self.scene.width / 2
        return [(-x, -y, z), (x, -y, z), (x, y, z), (-x, y, z), (-x, -y, z)]

    def ray(self, view: int, pixel: tuple[int, int], disparity: float) -> list[Point]:
        """The ray from a view's centre through the point of a reference pixel (row, column), to the farthest plane."""
        scene = self.scene
        z, last = self.depth(disparity), self.depth(self.ends[0])
        y, x = (
            (place - (size - 1) / 2) / scene.width * z
            for place, size in zip(pixel, (scene.height, scene.width), strict=True)
        )
        centre, reach = scene.steps(view) * self.baseline, max(last, z) / z
        return [(centre, 0.0, 0.0), (x, y, z), (centre + (x - centre) * reach, y * reach, z * reach)]

    def eye(self, points: NDArray[np.float32]) -> Eye | None:
        """Where to look from: behind the reference view, a little from the right and above; None without points."""
        if not len(points):
            return None
        # from behind the reference view, so that the cameras are in sight; a step aside shows depth
        depth = float(np.median(points[:, 2]))
        return from_the_side(np.array([0, 0, depth]), 1.3 * depth)


def from_the_side(target: NDArray[np.floating], distance: float) -> Eye:
    """The eye at a distance before a point, a little from the right and above (x right, y down)."""
    towards = np.array([0.4, -0.3, -1.0])
    x, y, z = (target + towards / np.linalg.norm(towards) * distance).tolist()
    a, b, c = target.tolist()
    return (x, y, z), (a, b, c)
