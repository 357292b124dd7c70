"""A run for figures, and scenes made up."""

from pathlib import Path

import numpy as np
import pytest
from places import METHODS

from matbench import comparison
from matbench.scene import Range, Scene

SMALL = "synthetic/box[size=96x72]"


def figured(factory: pytest.TempPathFactory) -> Path:
    """Folder of a run of the literal method, one without a volume, and one of a user's own file."""
    folder = factory.mktemp("figures") / "run"
    chosen = ["materiality[preset=paper passes=3]", "okutomi_kanade", "flat"]
    comparison.prepare(chosen, SMALL, out=folder, plugin=METHODS).run()
    return folder


def made(name: str, truth: bool = True) -> Scene:
    values = np.tile(np.linspace(1, 4, 24, dtype=np.float32), (16, 1))
    views = np.zeros((2, 16, 24, 3), np.uint8)
    return Scene(name, views, ("a", "b"), 0, Range(0, 5), {0: values} if truth else {}, 1.0)
