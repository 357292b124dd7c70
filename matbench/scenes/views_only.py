"""Scenes as methods may see them: views and range, and ground truth never in the memory of the process.

A process that runs methods gets its scenes as files that another process has written. Were the scene read where it is
solved, its truth would stay in freed memory, and a method that returns fresh memory would return it.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from attrs import evolve

from matbench.errors import UserError, one_line
from matbench.files.arrays import opened_arrays
from matbench.files.documents import parse_json
from matbench.files.temporary import temporary_folder
from matbench.scene import Range, Scene

VARIABLE = "MATBENCH_VIEWS_ONLY"
"""Set in the environment of processes that run methods, and so in that of all that they start."""
_PATIENCE = 600  # seconds that another process has to read a scene


def without_truth(scene: Scene) -> Scene:
    """The scene as a method may see it: without ground truth, regions, visibility and the held-out view."""
    return evolve(scene, truth={}, regions={}, visible={}, held_out=None, sparse=False)


def write_views(scene: Scene, path: Path) -> None:
    """Write what a method may see of a scene: views, labels, reference view and range."""
    facts = {
        "name": scene.name,
        "labels": scene.labels,
        "ref": scene.ref,
        "disparities": (scene.disparities.least, scene.disparities.largest),
        "pair_steps": scene.pair_steps,
        "positions": scene.positions,
    }
    np.savez(path, views=scene.views, facts=np.array(json.dumps(facts)))


def read_views(path: Path) -> Scene:
    """The scene in a file that `write_views` wrote: without truth, regions and visibilities."""
    with opened_arrays(path) as arrays:
        views, facts = arrays.read("views"), parse_json(str(arrays.read("facts")).encode())
    return Scene(
        name=facts["name"],
        views=views,
        labels=tuple(facts["labels"]),
        ref=facts["ref"],
        disparities=Range(*facts["disparities"]),
        truth={},
        pair_steps=facts["pair_steps"],
        positions=tuple(facts["positions"]),
    )


def wanted() -> bool:
    """Does this process, or one that it descends from, run methods?"""
    return VARIABLE in os.environ


def from_another_process(name: str, data: str | Path | None, files: Sequence[Path] = ()) -> Scene:
    """Have a fresh process load a scene, and take its views only.

    Parameters
    ----------
    files
        The users' own files that may hold its dataset.

    Raises
    ------
    UserError
        As `matbench.load_scene`.
    """
    environment = {key: value for key, value in os.environ.items() if key != VARIABLE}
    with temporary_folder() as folder:
        path = folder / "scene.npz"
        line = [sys.executable, "-m", "matbench.scenes.reader", str(path), name, str(data or ""), *map(str, files)]
        try:
            done = subprocess.run(  # noqa: S603 -- this interpreter, and arguments that are no options
                line, env=environment, capture_output=True, text=True, timeout=_PATIENCE, check=False
            )
        except (OSError, subprocess.SubprocessError) as error:
            raise UserError(f"{name} cannot be read: {one_line(error)}") from error
        if done.returncode:
            said = done.stderr.strip().splitlines() or [f"reading {name} ended with status {done.returncode}"]
            raise UserError(said[-1])
        return read_views(path)
