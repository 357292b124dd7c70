"""A stereo program of many views: ``LAYOUT PATH REF NEAR FAR OUT [disp|depth]``, for each layout that is written.

It uses the cameras and nothing else: for each depth, every view is warped to the reference view by the plane's
homography K_j (R_j + t_j n' / Z) K_r^-1 relative to the reference camera. Absolute differences in windows, the better
half of the views.
"""

import json
import sys
from pathlib import Path

import cv2
import numpy as np

layout, path, ref, near, far, out = sys.argv[1:7]
path, ref, near, far, out = Path(path), int(ref), float(near), float(far), Path(out)
kind = (sys.argv[7:] or ["depth"])[0]
assert not list(Path.cwd().iterdir()), "a folder of its own"


def rows(text):
    return np.array([[float(word) for word in line.split()] for line in text.strip().splitlines()])


cameras, images, half = [], [], 0.0
if layout == "json":
    facts = json.loads(path.read_text())
    assert facts["reference"] == ref
    assert np.allclose(facts["depths"], [near, far])
    for view in facts["views"]:
        images.append(path.parent / view["file"])
        cameras.append((np.array(view["K"]), np.array(view["Rt"])))
elif layout == "colmap":
    half = 0.5  # its columns begin at the edge of a pixel
    lenses = {}
    for line in (path / "sparse/cameras.txt").read_text().splitlines():
        number, model, width, height, fx, fy, cx, cy = line.split()
        assert model == "PINHOLE"
        lenses[number] = np.array([[float(fx), 0, float(cx)], [0, float(fy), float(cy)], [0, 0, 1]])
    for line in (path / "sparse/images.txt").read_text().splitlines()[::2]:
        _, qw, qx, qy, qz, *t, lens, name = line.split()
        assert [qw, qx, qy, qz] == ["1", "0", "0", "0"]
        images.append(path / "images" / name)
        cameras.append((lenses[lens], np.hstack([np.eye(3), np.array(t, float)[:, None]])))
    assert (path / "stereo/patch-match.cfg").read_text().startswith(f"im{ref}.png\n")
elif layout == "pmvs":
    for file in sorted((path / "txt").iterdir()):
        head, _, text = file.read_text().partition("\n")
        assert head == "CONTOUR"
        k, r, c, *_ = cv2.decomposeProjectionMatrix(rows(text))
        images.append(path / "visualize" / f"{file.stem}.ppm")
        cameras.append((k / k[2, 2], np.hstack([r, -r @ (c[:3] / c[3])])))
elif layout == "mvsnet":
    count = int((path / "pair.txt").read_text().split()[0])
    for view in range(count):
        outer, inner, reach = (path / f"cams/{view:08d}_cam.txt").read_text().split("\n\n")
        images.append(path / f"images/{view:08d}.png")
        cameras.append((rows(inner.removeprefix("intrinsic\n")), rows(outer.removeprefix("extrinsic\n"))[:3]))
        assert np.allclose([float(word) for word in reach.split()][::3], [near, far])

pictures = [cv2.imread(str(file)).astype(np.float32) for file in images]
height, width, _ = pictures[ref].shape
(k_ref, rt_ref) = cameras[ref]
turned = np.linalg.inv(rt_ref[:, :3])
centre = np.array([[1, 0, half], [0, 1, half], [0, 0, 1]])  # from whole numbers to the columns of the layout
best, found = np.full((height, width), np.inf, np.float32), np.zeros((height, width), np.float32)
for inverse in np.linspace(1 / far, 1 / near, 40):
    costs = []
    for (k, rt), picture in zip(cameras, pictures, strict=True):
        if picture is pictures[ref]:
            continue
        r = rt[:, :3] @ turned
        t = rt[:, 3] - r @ rt_ref[:, 3]
        plane = k @ (r + np.outer(t, [0, 0, inverse])) @ np.linalg.inv(k_ref)
        plane = np.linalg.inv(centre) @ plane @ centre
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        there = cv2.warpPerspective(picture, plane, (width, height), flags=flags, borderValue=(-999,) * 3)
        costs.append(cv2.boxFilter(np.abs(there - pictures[ref]).mean(axis=2), -1, (7, 7)))
    cost = np.sort(costs, axis=0)[: (len(costs) + 1) // 2].mean(axis=0)
    better = cost < best
    best[better], found[better] = cost[better], 1 / inverse
if kind == "depth":
    np.save(out / "depth.npy", found)
else:
    shift = json.loads(path.read_text())["shift"]
    np.save(out / "disp.npy", width / found - shift)
