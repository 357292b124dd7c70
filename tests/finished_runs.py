"""Runs that are done."""

from pathlib import Path

from places import METHODS

from matbench import comparison
from matbench.runs.lock import locked

SMALL = "synthetic/box[size=48x36]"


def done(folder: Path, *algorithms: str, scene: str = SMALL, plugin: Path = METHODS) -> Path:
    ready = comparison.prepare(list(algorithms), scene, out=folder, plugin=plugin, command="typed")
    with locked(folder):
        ready.run()
        ready.tables()
    return folder
