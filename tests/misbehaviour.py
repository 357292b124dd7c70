"""What becomes of cells whose methods misbehave."""

from pathlib import Path

import pandas as pd
from places import METHODS, ROUGH

from matbench import comparison
from matbench.plans.settings import Settings

SMALL = "synthetic/box[size=96x72]"


def run(folder: Path, *algorithms: str, **settings: object) -> pd.DataFrame:
    ready = comparison.prepare(
        list(algorithms), SMALL, out=folder, plugin=[ROUGH, METHODS], settings=Settings(**settings)
    )
    ready.run()
    cells = ready.tables().cells.set_index("algorithm")
    cells["log"] = [(folder / "cells" / key / "log.txt").read_text(errors="replace") for key in cells.cell]
    assert not list((folder / "cells").glob(".*")), "no drafts"
    return cells


EXPECTED = {
    "segfaults": ("crashed", "segmentation fault, SIGSEGV", "Fatal Python error: Segmentation fault"),
    "aborts": ("crashed", "SIGABRT", "in misbehave"),
    "exits": ("crashed", "exit status 7", ""),
    "leaves": ("failed", "SystemExit", ""),
    "overflows": ("crashed", "segmentation fault", "in deeper"),
    "loops": ("timeout", "stopped after 5 s", "in misbehave"),
    "allocates": ("out-of-memory", "MemoryError: Unable to allocate 1.00 TiB", "in misbehave"),
    "grows": ("out-of-memory", "400 MiB are its limit", "Grows begins"),
    "chatters": ("ok", "", "the last line, from C"),
    "upsets": ("ok", "", "Upsets begins"),
    "breeds": ("ok", "", "Breeds begins"),
    "scribbles": ("crashed", "wrote into a file of the harness", "Scribbles begins"),
    "splits": ("ok", "", "Splits begins"),
    "interrupts": ("interrupted", "KeyboardInterrupt", "in misbehave"),
    "tampers": ("failed", "the method wrote into its input", "Tampers begins"),
    "writes": ("failed", "read-only", "in solve"),
    "bare": ("failed", "ndarray, not an Estimate", ""),
    "orphans": ("crashed", "its keeper was killed", ""),
    "flat": ("ok", "", ""),
}
