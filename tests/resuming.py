"""Runs that are watched from outside while they are disturbed."""

import json
import sys
from pathlib import Path

import numpy as np
from launcher import SCENE

PATIENCE = 900


PLUGIN = """
import os
from pathlib import Path
import numpy as np
from matbench import Estimate

def tell(scene, what):
    if scene.height > 16 and "JOURNAL" in os.environ:  # the warm-up is on fewer rows
        with Path(os.environ["JOURNAL"]).open("a") as file:
            file.write(f"{what}\\n")

class Steady:
    def solve(self, scene, context):
        tell(scene, f"steady {context.seed}")
        return Estimate({scene.ref: np.full(scene.views.shape[1:3], 1 + context.seed / 16, np.float32)})

class Seeded:
    def solve(self, scene, context):
        tell(scene, f"seeded {context.seed}")
        values = np.random.default_rng(context.seed).random(scene.views.shape[1:3], np.float32)
        return Estimate({scene.ref: 3 * values})
"""


def command(plugin: Path, out: Path, *more: str) -> list[str]:
    line = [sys.executable, "-m", "matbench", "compare", "--plugin", str(plugin), "--out", str(out), *more]
    return line if "-s" in more else [*line, "-s", SCENE]


def finished(run: Path) -> dict[str, tuple[int, int]]:
    """Key -> inode and time of every cell that is done; each must be whole."""
    out = {}
    for folder in (run / "cells").glob("[0-9a-f]*"):
        facts = json.loads((folder / "cell.json").read_text())
        assert {path.name for path in folder.iterdir()} <= {"cell.json", "disparity.npz", "log.txt"}
        if facts["outcome"]["status"] == "ok":
            with np.load(folder / "disparity.npz", allow_pickle=False) as maps:
                assert maps["view_2"].shape == (36, 48)
            stat = (folder / "cell.json").stat()
            out[facts["cell"]["key"]] = stat.st_ino, stat.st_mtime_ns
    return out
