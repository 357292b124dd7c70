"""What a run of many cells costs besides solving, and whether it goes on after `kill -9` and computes nothing twice.

    python tests/proofs/many.py [WORLDS [HOW ...]]      30, and each of process, shared and dask; 1000 is the aim

Ten settings of a method that does nothing run on so many small random worlds, once for each HOW: in a process for each
cell, in one that solves cell after cell, and on a local Dask cluster. Half-way the run is killed by signal 9 and then
started again. Printed are seconds from cell to cell, from the times at which they were stored: nearly all of it is the
harness's. It fails where a cell that had been stored is solved again, where one is missing, or where an aim is missed.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

AIMS = {"process": 0.25, "shared": 0.05, "dask": 0.25}
OPTIONS = {
    "process": ["--isolation", "process"],
    "shared": ["--isolation", "shared"],
    "dask": ["--dask", "local", "--jobs", "2"],
}
METHOD = """
import numpy as np
from matbench import Estimate

class Flat:
    def __init__(self, value: int = 1) -> None:
        self.value = value

    def solve(self, scene, context):
        return Estimate({scene.ref: np.full((scene.height, scene.width), self.value, np.float32)})
"""


def stored(run: Path) -> dict[str, float]:
    """Cell -> when it was stored; drafts, whose names begin with a point, are no cells yet."""
    return {path.parent.name: path.stat().st_mtime for path in run.glob("cells/[!.]*/cell.json")}


def from_cell_to_cell(times: list[float]) -> tuple[float, float]:
    """Seconds that nine in ten take at most, and their mean without the longest: where a run begins again is a gap."""
    return float(np.quantile(np.diff(sorted(times)), 0.9)), float(np.mean(np.sort(np.diff(sorted(times)))[:-1]))


def measured(worlds: int, how: str, folder: Path) -> list[str]:
    run, plugin = folder / how, folder / "flat.py"
    plugin.write_text(METHOD)
    scenes = f"synthetic/world[seed={','.join(map(str, range(worlds)))} size=48x36]"
    line = [
        sys.executable,
        "-m",
        "matbench",
        "compare",
        "--plugin",
        str(plugin),
        "-a",
        "flat[value=0,1,2,3,4,5,6,7,8,9]",
    ]
    line += ["-s", scenes, "--quiet", "--out", str(run), *OPTIONS[how]]
    cells, begun = 10 * worlds, time.monotonic()
    first = subprocess.Popen(line, start_new_session=True)
    while len(list(run.glob("cells/*"))) < cells // 2 and first.poll() is None:
        time.sleep(0.2)
    killed = first.poll() is None
    os.kill(first.pid, signal.SIGKILL)
    first.wait()
    before = stored(run)
    again = subprocess.run(line, check=False)
    after, seconds = stored(run), time.monotonic() - begun
    most, each = from_cell_to_cell(list(after.values()))
    print(
        f"{how}: {cells} cells, {each:.3f} s from cell to cell (nine in ten at most {most:.3f}), {len(before)} stored "
        f"when it was killed, {seconds:.0f} s in all, page {(run / 'report.html').stat().st_size / 1e6:.1f} MB",
        flush=True,
    )
    wrong = [] if killed else [f"{how}: it ended before it was killed"]
    wrong += [] if again.returncode == 0 else [f"{how}: exit status {again.returncode}"]
    wrong += [] if len(after) == cells else [f"{how}: {len(after)} of {cells} cells are stored"]
    twice = [key for key, when in before.items() if after.get(key) != when]
    wrong += [f"{how}: {len(twice)} cells were solved again"] if twice else []
    wrong += [f"{how}: {each:.3f} s from cell to cell"] if each > AIMS[how] else []
    return wrong


def main(worlds: int, hows: list[str]) -> int:
    """Measure, print, and return 1 where something is wrong."""
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        for how in hows:
            wrong += measured(worlds, how, Path(folder))
    for one in wrong:
        print(one)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if sys.argv[1:] else 30, sys.argv[2:] or list(AIMS)))
