"""What goes wrong around a run is told by its cause, in one line."""

import subprocess
import sys
from pathlib import Path

from places import METHODS

TWICE = """
import sys
from pathlib import Path
from matbench.cli import main
Path.cwd().rmdir()
for line in (["status", "run"], sys.argv[1:], [*sys.argv[1:], "--out", "run"]):
    try:
        main(line)
    except SystemExit as end:
        print(end.code)
"""
HOMELESS = """
import os
from contextlib import suppress
import numpy as np
from matbench import Estimate

class Homeless:
    def solve(self, scene, context):
        with suppress(OSError):
            os.rmdir(os.getcwd())
        return Estimate({scene.ref: np.ones(scene.views.shape[1:3], np.float32)})
"""
SMALL = "synthetic/box[size=48x36]"


def test_a_working_folder_that_has_been_deleted_is_named(tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    line = ["compare", "-a", "flat", "--plugin", str(METHODS), "-s", SMALL]
    done = subprocess.run(
        [sys.executable, "-c", TWICE, *line], cwd=tmp_path / "gone", capture_output=True, text=True, timeout=300
    )
    assert done.stdout.split() == ["2", "2", "2"]
    assert done.stderr.count("\n") == 3
    assert all(
        "the working folder has been deleted: change into another one" in one for one in done.stderr.splitlines()
    )


def test_a_run_goes_on_where_its_working_folder_is_deleted_meanwhile(tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    (tmp_path / "homeless.py").write_text(HOMELESS)
    line = [sys.executable, "-m", "matbench", "compare", "-q", "-a", "homeless", "--seed", "0", "1"]
    line += ["--plugin", str(tmp_path / "homeless.py"), "-s", SMALL, "--out", str(tmp_path / "run")]
    done = subprocess.run(line, cwd=tmp_path / "gone", capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    assert not (tmp_path / "gone").exists()
    assert (tmp_path / "run" / "report.html").exists()
