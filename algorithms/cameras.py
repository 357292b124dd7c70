"""Views of a scene with cameras, written as programs for many views read them.

Rectified views say where lines of sight meet only up to scale, and with a shift. Here the baseline of a view step is 1,
and the focal length is the width of an image, W pixels. With a shift of s pixels, the depth of disparity d is

    Z = W / (d + s).

The camera of view j has the principal point c_x + p_j s, where p_j are the view steps from the reference view, and its
centre at (p_j, 0, 0). So it sees a point of depth Z at x - p_j (W / Z - s) = x - p_j d, in the same row. All cameras
look along z; x is right, y is down. The shift is 0 if the least depth is at least a `DEEPEST` th of the largest then.
Otherwise it is the least that makes it so: disparities at or below 0 would lie at infinity or behind the cameras.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import cv2
import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.scene import Scene

DEEPEST = 20.0
"""Largest ratio of depths: programs sample the range in depth or in its inverse."""


@frozen(eq=False)
class Rig:
    """The cameras of a scene; see the module."""

    scene: Scene
    shift: float

    @classmethod
    def of(cls, scene: Scene) -> "Rig":
        """The cameras with the least shift."""
        least, largest = scene.disparities.least, scene.disparities.largest
        shift = max(0.0, (largest - DEEPEST * least) / (DEEPEST - 1))
        return cls(scene, shift if least + shift > 0 else 1.0 - least)

    @property
    def depths(self) -> tuple[float, float]:
        """The nearest and the farthest depth of the scene's range."""
        width, ends = self.scene.width, self.scene.disparities
        return width / (ends.largest + self.shift), width / (ends.least + self.shift)

    def disparity(self, depth: NDArray[np.floating]) -> NDArray[np.float32]:
        """Disparities of depths, px per view step; NaN where a depth is not above 0."""
        values = depth.astype(np.float64)
        known = np.isfinite(values) & (values > 0)
        found = self.scene.width / np.where(known, values, 1.0) - self.shift
        return np.where(known, found, np.nan).astype(np.float32)

    def intrinsics(self, view: int) -> NDArray[np.float64]:
        """(3, 3) K of a view; pixel centres lie at whole numbers."""
        scene = self.scene
        across, down = (scene.width - 1) / 2 + scene.steps(view) * self.shift, (scene.height - 1) / 2
        return np.array([[scene.width, 0, across], [0, scene.width, down], [0, 0, 1]], np.float64)

    def extrinsics(self, view: int) -> NDArray[np.float64]:
        """(3, 4) [R | t] of a view: R is the identity."""
        return np.hstack([np.eye(3), [[-self.scene.steps(view)], [0], [0]]])


def write_views(rig: Rig, folder: Path) -> None:
    """The views: ``im0.png``, ``im1.png``, ..., from left to right."""
    for view in range(rig.scene.n):
        _write_image(folder / f"im{view}.png", rig.scene.views[view])


def write_json(rig: Rig, file: Path) -> None:
    """All in one document, with the views beside it."""
    scene, (near, far) = rig.scene, rig.depths
    write_views(rig, file.parent)
    views = [
        {
            "file": f"im{view}.png",
            "position": scene.steps(view),
            "K": rig.intrinsics(view).tolist(),
            "Rt": rig.extrinsics(view).tolist(),
        }
        for view in range(scene.n)
    ]
    facts = {
        "views": views,
        "reference": scene.ref,
        "width": scene.width,
        "height": scene.height,
        "disparities": [scene.disparities.least, scene.disparities.largest],
        "depths": [near, far],
        "shift": rig.shift,
    }
    file.write_text(json.dumps(facts, indent=1), encoding="utf-8")


def write_colmap(rig: Rig, folder: Path) -> None:
    """A workspace of COLMAP for dense stereo: ``images``, ``sparse`` as text, ``stereo/patch-match.cfg``.

    COLMAP counts columns from the left edge of a pixel, so that its centre lies at one half. There are no points: the
    range of depths must be given. Reference: https://colmap.github.io/format.html.
    """
    scene = rig.scene
    for name in ("images", "sparse", "stereo/depth_maps", "stereo/normal_maps", "stereo/consistency_graphs"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    write_views(rig, folder / "images")
    cameras, images = [], []
    for view in range(scene.n):
        k, t = rig.intrinsics(view), rig.extrinsics(view)[:, 3]
        numbers = _words(k[0, 0], k[1, 1], k[0, 2] + 0.5, k[1, 2] + 0.5)
        cameras.append(f"{view + 1} PINHOLE {scene.width} {scene.height} {numbers}\n")
        images.append(f"{view + 1} 1 0 0 0 {_words(*t)} {view + 1} im{view}.png\n\n")
    (folder / "sparse" / "cameras.txt").write_text("".join(cameras))
    (folder / "sparse" / "images.txt").write_text("".join(images))
    (folder / "sparse" / "points3D.txt").write_text("")
    others = ", ".join(f"im{view}.png" for view in range(scene.n) if view != scene.ref)
    (folder / "stereo" / "patch-match.cfg").write_text(f"im{scene.ref}.png\n{others}\n")
    (folder / "stereo" / "fusion.cfg").write_text(f"im{scene.ref}.png\n")


def write_pmvs(rig: Rig, folder: Path) -> None:
    """A folder of PMVS: ``visualize/%08d.ppm``, ``txt/%08d.txt`` with P = K [R | t], and ``option.txt``."""
    scene = rig.scene
    for name in ("visualize", "txt", "models"):
        (folder / name).mkdir(parents=True)
    for view in range(scene.n):
        _write_image(folder / "visualize" / f"{view:08d}.ppm", scene.views[view])
        projection = rig.intrinsics(view) @ rig.extrinsics(view)
        rows = "\n".join(_words(*row) for row in projection)
        (folder / "txt" / f"{view:08d}.txt").write_text(f"CONTOUR\n{rows}\n")
    options = {"level": 0, "csize": 1, "threshold": 0.7, "wsize": 7, "minImageNum": 2, "useVisData": 0, "sequence": -1}
    listed = "\n".join(f"{name} {value}" for name, value in options.items())
    (folder / "option.txt").write_text(f"{listed}\ntimages -1 0 {scene.n}\noimages 0\n")


def write_mvsnet(rig: Rig, folder: Path) -> None:
    """A folder of MVSNet: ``images/%08d.png``, ``cams/%08d_cam.txt`` and ``pair.txt``.

    Behind a camera stand the least depth, the interval, the number of planes and the largest depth. Planes lie at most
    one pixel of the field's pair apart where they are nearest.
    """
    scene, (near, far) = rig.scene, rig.depths
    for name in ("images", "cams"):
        (folder / name).mkdir(parents=True)
    finest = scene.width / (scene.disparities.largest + rig.shift - 1 / scene.pair_steps) - near
    planes = int(np.clip(np.ceil((far - near) / finest) + 1 if finest > 0 else 2, 2, 1024))
    reach = _words(near, (far - near) / (planes - 1), planes, far)
    for view in range(scene.n):
        _write_image(folder / "images" / f"{view:08d}.png", scene.views[view])
        outer = "\n".join(_words(*row) for row in [*rig.extrinsics(view), [0, 0, 0, 1]])
        inner = "\n".join(_words(*row) for row in rig.intrinsics(view))
        (folder / "cams" / f"{view:08d}_cam.txt").write_text(f"extrinsic\n{outer}\n\nintrinsic\n{inner}\n\n{reach}\n")
    listed = []
    for view in range(scene.n):
        near_first = sorted((abs(scene.places[other] - scene.places[view]), other) for other in range(scene.n))[1:]
        scores = " ".join(f"{other} {1 / away:.6g}" for away, other in near_first)
        listed.append(f"{view}\n{len(near_first)} {scores}\n")
    (folder / "pair.txt").write_text(f"{scene.n}\n{''.join(listed)}")


LAYOUTS: Mapping[str, tuple[str, Callable[[Rig, Path], None]]] = {
    "{views}": ("views", write_views),
    "{json}": ("scene/scene.json", write_json),
    "{colmap}": ("colmap", write_colmap),
    "{pmvs}": ("pmvs", write_pmvs),
    "{mvsnet}": ("mvsnet", write_mvsnet),
}
"""What stands for a layout -> where it is written, and what writes it."""


def _words(*numbers: float) -> str:
    return " ".join(f"{number:.12g}" for number in numbers)


def _write_image(path: Path, image: NDArray[np.uint8]) -> None:
    if not cv2.imwrite(str(path), np.ascontiguousarray(image[..., ::-1])):
        raise OSError(f"{path} could not be written")
