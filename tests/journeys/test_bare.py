"""In a bare container everything works: no user of that name, no HOME, no variables, nothing to be written but here."""

import json
from pathlib import Path

from places import METHODS
from strangers import run

SCENE = "synthetic/box[size=64x48]"
KEPT = "matbench: compiled kernels are not kept, each run compiles its own: "


def test_a_run_from_end_to_end_without_a_home(tmp_path: Path) -> None:
    done = run(tmp_path, ["compare", "-a", "sgbm", "-s", SCENE, "--out", "run", "--record", "--json"])
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["cells"] == {"ok": 1}
    said = done.stderr.splitlines()
    assert said[0] == f"{KEPT}there is no home folder: set HOME, or XDG_CACHE_HOME to the absolute path of a folder"
    assert len([line for line in said if "home" in line or "cache" in line.lower()]) == 1, done.stderr
    done = run(tmp_path, ["figure", "maps", "run"])
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} == {"run"}, "no folder called ~"


def test_lists_and_downloads_without_a_home(tmp_path: Path) -> None:
    done = run(tmp_path, ["list", "--json"])
    assert (done.returncode, done.stderr) == (0, "")
    assert not [one for one in json.loads(done.stdout)["algorithms"].values() if "error" in one]
    done = run(tmp_path, ["fetch", "middlebury2003/teddy", "--dry-run"])
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "there is no home folder: give the folder of scenes by --data or MATBENCH_DATA" in done.stderr
    done = run(tmp_path, ["scene", "show", SCENE, "--out", "sheet.png"])
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} == {"sheet.png"}


def test_kernels_are_compiled_where_the_home_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(METHODS.read_text() + KERNEL)
    chosen = ["--plugin", "own.py", "-a", "compiled", "-s", SCENE]
    done = run(tmp_path, ["compare", *chosen, "--out", "run", "--json"], HOME="/proc")
    assert json.loads(done.stdout)["cells"] == {"ok": 1}, done.stdout + done.stderr
    assert [line for line in done.stderr.splitlines() if "/proc" in line] == [
        f"{KEPT}/proc/.cache: No such file or directory"
    ]
    assert {path.name for path in tmp_path.iterdir()} == {"own.py", "run"}


KERNEL = """

from numba import njit


@njit(cache=True)
def _twice(x):
    return 2 * x


class Compiled:
    def solve(self, scene, context):
        return Estimate({scene.ref: np.full((scene.height, scene.width), _twice(1.0), np.float32)})
"""
