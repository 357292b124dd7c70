"""The example that runs COLMAP. COLMAP itself needs a graphics card: what stands in for it checks what it is given."""

import sys
from pathlib import Path

import numpy as np
import pytest
from shown import ROOT

from matbench import Context, load_scene
from matbench.algorithms.command import Command

EXAMPLE = ROOT / "docs/examples/colmap_stereo.py"
STANDS_IN = """
import sys
from pathlib import Path
import numpy as np
options = dict(zip(sys.argv[2::2], sys.argv[3::2]))
assert sys.argv[1] == "patch_match_stereo", sys.argv
place = Path(options["--workspace_path"])
near, far = (float(options[f"--PatchMatchStereo.depth_{end}"]) for end in ("min", "max"))
ref = (place / "stereo/patch-match.cfg").read_text().split()[0]
assert (place / "images" / ref).is_file() and (place / "sparse/images.txt").is_file()
depth = np.linspace(near, far, 48 * 36, dtype="<f4").reshape(36, 48)
depth[0] = 0
(place / f"stereo/depth_maps/{ref}.photometric.bin").write_bytes(b"48&36&1&" + depth.tobytes())
"""


def test_the_depths_that_colmap_writes_become_disparities(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "colmap"
    program.write_text(f"#!{sys.executable}\n{STANDS_IN}")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    scene = load_scene("synthetic/curved[n=4 ref=1 size=48x36]")
    method = Command(sys.executable, args=f"{EXAMPLE} {{colmap}} {{ref}} {{near}} {{far}} {{out}}")
    found = method.solve(scene, Context()).disparity[1]
    assert np.isnan(found[0]).all()
    assert found[-1, -1] == pytest.approx(scene.disparities.least, abs=1e-3)
    assert found[1, 0] < scene.disparities.largest
    assert (np.diff(found[1:].ravel()) < 0).all(), "row by row, from near to far"


def test_where_it_is_not_installed_that_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pycolmap.py").write_text("raise ImportError('none here')")
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    method = Command(sys.executable, args=f"{EXAMPLE} {{colmap}} {{ref}} {{near}} {{far}} {{out}}")
    said = "neither the program colmap nor the package pycolmap-cuda12 is installed"
    with pytest.raises(RuntimeError, match=said):
        method.solve(load_scene("synthetic/box[n=3 size=48x36]"), Context())
