"""COLMAP's dense stereo on a workspace that matbench wrote: ``colmap_stereo.py WORKSPACE REF NEAR FAR OUT``.

It takes the command `colmap`, else the package `pycolmap`. Both need to be built for a graphics card (CUDA) for this
step: the package of that name is not, `pycolmap-cuda12` is. What it answers is its own, geometric consistency left
out, as it would need a depth map of each view.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np


def run(workspace: Path, near: float, far: float) -> None:
    """Compute the depth map of the view that ``stereo/patch-match.cfg`` names."""
    if program := shutil.which("colmap"):
        numbers = {"depth_min": near, "depth_max": far, "geom_consistency": 0}
        options = [word for name, value in numbers.items() for word in (f"--PatchMatchStereo.{name}", str(value))]
        line = [program, "patch_match_stereo", "--workspace_path", str(workspace), *options]
        done = subprocess.run(line, check=False)  # noqa: S603 (a list of arguments, no shell)
        if done.returncode:
            sys.exit(f"{program} ended with status {done.returncode}")
        return
    try:
        import pycolmap
    except ImportError:
        sys.exit("neither the program colmap nor the package pycolmap-cuda12 is installed")
    options = pycolmap.PatchMatchOptions()
    options.depth_min, options.depth_max, options.geom_consistency = near, far, False
    try:
        pycolmap.patch_match_stereo(str(workspace), options=options)
    except ValueError as error:  # built without CUDA
        sys.exit(f"pycolmap cannot do it here: {error}")


def depth_map(file: Path) -> np.ndarray:
    """(H, W) float32: ``width&height&channels&`` and then the numbers, row by row; 0 is no answer."""
    data = file.read_bytes()
    width, height, channels, numbers = data.split(b"&", 3)
    if channels != b"1":
        sys.exit(f"{file} has {channels!r} channels, a depth map has one")
    return np.frombuffer(numbers, "<f4").reshape(int(height), int(width))


def main() -> None:
    workspace, ref, near, far, out = sys.argv[1:6]
    run(Path(workspace), float(near), float(far))
    np.save(Path(out, "depth.npy"), depth_map(Path(workspace, f"stereo/depth_maps/im{ref}.png.photometric.bin")))


if __name__ == "__main__":
    main()
