"""Two-view semi-global matching in its best-known implementation: OpenCV's StereoSGBM."""

from collections.abc import Mapping
from math import ceil, floor
from typing import ClassVar, Literal

import cv2
import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.parameters import odd
from matbench.scene import Scene

MODES = {
    "sgbm": cv2.STEREO_SGBM_MODE_SGBM,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "three_way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
}


@frozen
class SGBM:
    """OpenCV's StereoSGBM on the field's pair: a well-known method to compare with.

    Minimises along several paths through the image, after H. Hirschmüller, "Stereo processing by
    semiglobal matching and mutual information", IEEE PAMI 30(2), 2008,

    E(d) = sum over x of C(x, d(x)) + sum over neighbours of P1 * [|d(x) - d(x')| = 1] + P2 * [|d(x) - d(x')| > 1]

    with C the Birchfield-Tomasi dissimilarity summed over a block. The pair is the reference view
    and the view `pair_steps` to its right; else that to its left, both images mirrored; else the
    farthest view there is.

    Parameters
    ----------
    block_size
        Side of the block in pixels, odd.
    mode
        ``sgbm`` five paths, ``hh`` eight paths, ``three_way`` three.
    p1, p2
        P1 and P2 per colour and pixel of the block; OpenCV's documentation suggests 8 and 32.
    uniqueness
        By how many per cent the best cost must beat the second best, else there is no answer.
    speckle_window, speckle_range
        Connected patches of fewer pixels, within that many pixels of disparity, are discarded;
        a window of 0 keeps all.
    disp12_max_diff
        Largest difference of the left-right check in pixels of the pair, at least 1: OpenCV takes 0
        and less for 1.
    fill
        Fill holes from the farther side of their row?
    """

    uneven: ClassVar[bool] = True

    block_size: int = field(default=3, validator=odd)
    mode: Literal["sgbm", "hh", "three_way"] = field(default="sgbm", validator=validators.in_(MODES))
    p1: int = field(default=8, validator=validators.gt(0))
    p2: int = field(default=32, validator=validators.gt(0))
    uniqueness: int = field(default=10, validator=[validators.ge(0), validators.le(100)])
    speckle_window: int = field(default=100, validator=validators.ge(0))
    speckle_range: int = field(default=2, validator=validators.ge(0))
    disp12_max_diff: int = field(default=1, validator=validators.ge(1))
    fill: bool = True

    def __attrs_post_init__(self) -> None:
        if self.p2 <= self.p1:
            raise ValueError(f"p2 is {self.p2}; it must exceed p1, {self.p1}")

    @property
    def silent(self) -> Mapping[str, str]:
        """Parameter -> what it needs to have an effect, for those without effect beside the others."""
        return {} if self.speckle_window else {"speckle_range": "speckle_window above 0"}

    def solve(self, scene: Scene, context: Context) -> Estimate:  # noqa: ARG002 (nothing to seed)
        """Disparities of the reference view."""
        partner = field_partner(scene)
        left, right = scene.views[scene.ref], scene.views[partner]
        gap = abs(scene.steps(partner))
        mirrored = partner < scene.ref
        if mirrored:
            left, right = left[:, ::-1], right[:, ::-1]
        least, largest = floor(scene.disparities.least * gap), ceil(scene.disparities.largest * gap)
        pair = self.match(left, right, least, largest)
        disparity = pair[:, ::-1] / np.float32(gap) if mirrored else pair / np.float32(gap)
        disparity = fill_from_background(disparity) if self.fill else np.ascontiguousarray(disparity)
        return Estimate({scene.ref: disparity}, work={"pixel_disparities": disparity.size * _tried(least, largest)})

    def match(self, left: NDArray[np.uint8], right: NDArray[np.uint8], least: int, largest: int) -> NDArray[np.float32]:
        """Disparities of the left image of a pair, x_right = x_left - d.

        OpenCV answers only where the whole range stays inside the right image. Therefore both images are
        padded at their sides with repeated edge pixels, so that every pixel is tried. If fewer columns
        than half a block remain to be answered, OpenCV's result varies from call to call. Therefore
        images narrower than a block are made as wide as a block.

        Parameters
        ----------
        left, right
            (H, W, 3) uint8.
        least, largest
            The range in whole pixels.

        Returns
        -------
        (H, W) float32, in pixels, NaN where there is no answer.
        """
        number = _tried(least, largest)
        before = max(0, least + number)
        after = max(0, -least) + max(0, self.block_size - left.shape[1])
        area = 3 * self.block_size**2
        matcher = cv2.StereoSGBM.create(
            minDisparity=least,
            numDisparities=number,
            blockSize=self.block_size,
            P1=self.p1 * area,
            P2=self.p2 * area,
            disp12MaxDiff=self.disp12_max_diff,
            preFilterCap=63,
            uniquenessRatio=self.uniqueness,
            speckleWindowSize=self.speckle_window,
            speckleRange=self.speckle_range,
            mode=MODES[self.mode],
        )
        sides = ((0, 0), (before, after), (0, 0))
        sixteenths = matcher.compute(np.pad(left, sides, mode="edge"), np.pad(right, sides, mode="edge"))
        disparity = np.asarray(sixteenths[:, before : before + left.shape[1]], np.float32) / np.float32(16)
        disparity[(disparity < least) | (disparity > largest)] = np.nan
        return disparity


def _tried(least: int, largest: int) -> int:
    """How many disparities OpenCV tries to cover a range: a multiple of 16."""
    return 16 * ceil((largest - least + 1) / 16)


def field_partner(scene: Scene) -> int:
    """Index of the view to match the reference view with; see `SGBM`."""
    if not scene.is_even:
        found = scene.at(scene.pair_steps), scene.at(-scene.pair_steps)
        ends = scene.n - 1 if scene.steps(scene.n - 1) >= -scene.steps(0) else 0
        return next((view for view in found if view is not None), ends)
    gap = max(1, round(scene.pair_steps))
    for partner in (scene.ref + gap, scene.ref - gap):
        if 0 <= partner < scene.n:
            return partner
    return scene.n - 1 if 2 * scene.ref < scene.n else 0
