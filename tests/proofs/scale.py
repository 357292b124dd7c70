"""What a run of many cells costs besides solving: tables, sweeps, page, status and the look at what is left.

    python tests/proofs/scale.py [CELLS ...]        100 1000 by default; 10000 is the aim

Every size is a run of ten settings of one method on scenes made up here, which are random and small; its cells are
stored as a run stores them, with random maps. So nothing is solved, and every second is the harness's. Printed are
processor seconds of every step, the memory that the process came to, the size of the page, and how steps grow from the
smallest to the largest size: the exponent of their seconds over the number of cells.

It fails where a step grows faster than by an exponent of `MOST_GROWTH`, or where a run of 10,000 cells misses an aim.
"""

import resource
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import log
from pathlib import Path

import numpy as np

from matbench.plans.plan import make_plan, methods
from matbench.plans.settings import Settings
from matbench.prepared import Comparison
from matbench.results.status import standing
from matbench.runs.cell_files import write_cell
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scene import Range, Scene

SETTINGS = "okutomi_kanade[window=3,5,7,9,11,13,15,17,19,21]"
SIZE = (36, 48)
MOST_GROWTH = 1.05
SLACK = 0.05  # seconds: below this a step is over before it can grow
AIMS = {"tables": 60.0, "sweeps": 60.0, "page": 60.0, "status": 2.0}
MOST_MIB, MOST_PAGE = 2048, 15_000_000


def scene(number: int) -> Scene:
    draw = np.random.default_rng(number)
    truth = draw.uniform(1, 4, SIZE).astype(np.float32)
    views = draw.integers(0, 255, (3, *SIZE, 3), dtype=np.uint8)
    masks = {name: draw.random(SIZE) < share for name, share in (("nonocc", 0.8), ("occ", 0.2), ("disc", 0.3))}
    regions = {"all": np.ones(SIZE, bool), **masks}
    return Scene(f"made/s{number}", views, ("a", "b", "c"), 1, Range(0, 5), {1: truth}, 2.0, regions)


def stored(folder: Path, cells: int) -> Comparison:
    """A finished run."""
    chosen = methods(SETTINGS)
    scenes = {one.name: one for one in map(scene, range(max(1, cells // len(chosen))))}
    plan = make_plan(chosen, scenes, [0])
    store, draw = Store.open(folder, plan, "made up"), np.random.default_rng(0)
    for cell in plan.cells:
        wrong = draw.random(SIZE) < 0.1
        maps = {1: np.where(wrong, np.float32(0.5), scenes[cell.scene].truth[1])}
        with store.building(cell) as draft:
            write_cell(draft, cell, Outcome("ok", seconds=0.01, threads=1, alone=True), maps)
    return Comparison(plan, store, scenes, Settings(), "made up")


@contextmanager
def timed(spent: dict[str, float], step: str) -> Iterator[None]:
    begun = time.process_time()
    yield
    spent[step] = time.process_time() - begun


def measured(cells: int) -> Mapping[str, float]:
    spent: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        with timed(spent, "storing"):
            ready = stored(Path(folder) / "run", cells)
        with timed(spent, "left"):
            todo = ready.pending()
        assert not todo.cells
        with timed(spent, "tables"):
            tables = ready.tables()
        with timed(spent, "sweeps"):
            sweeps = ready.sweeps(tables.results)
        with timed(spent, "page"):
            page = ready.report(tables, sweeps=sweeps)
        with timed(spent, "status"):
            found = standing(ready.folder)
        assert (found.left, found.tables) == (0, ""), found
        spent["page MB"] = page.stat().st_size / 1e6
    spent["MiB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{cells:6} cells: " + ", ".join(f"{step} {value:.2f}" for step, value in spent.items()), flush=True)
    return spent


def main(sizes: list[int]) -> int:
    """Measure, print, and return 1 where something grows too fast or an aim is missed."""
    measured(20)  # imports and caches
    found = {size: measured(size) for size in sizes}
    least, most = min(found), max(found)
    wrong = []
    for step in ("storing", "left", *AIMS):
        before, after = found[least][step], found[most][step]
        growth = log(max(after, SLACK) / max(before, SLACK)) / log(most / least) if most > least else 0.0
        print(f"{step}: exponent {growth:.2f}")
        wrong += [f"{step} grows with an exponent of {growth:.2f}"] if growth > MOST_GROWTH else []
    if most >= 10_000:
        wrong += [f"{step} takes {found[most][step]:.0f} s" for step, aim in AIMS.items() if found[most][step] > aim]
        wrong += [f"{found[most]['MiB']:.0f} MiB"] if found[most]["MiB"] > MOST_MIB else []
        wrong += [f"a page of {found[most]['page MB']:.0f} MB"] if found[most]["page MB"] * 1e6 > MOST_PAGE else []
    for line in wrong:
        print(f"too much: {line}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main([int(text) for text in sys.argv[1:]] or [100, 1000]))
