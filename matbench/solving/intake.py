"""What a process that ran a method has left in its folder: checked by the keeper, and made a cell.

Nothing there is believed: files must be plain ones of a bounded size, maps must have the scene's shape, and what the
keeper has counted itself, seconds above all, does not come from there.
"""

import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from attrs import evolve
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.runs.outcome import Outcome
from matbench.runs.store import read_maps
from matbench.scene import Scene
from matbench.solving.worker import OUTCOME

_MOST_FACTS = 1 << 24  # bytes of an outcome: histories of long runs take some
_MOST_FILE = 1 << 32
_PIECE = 1 << 20

_json = make_converter()


def outcome(folder: Path) -> Outcome:
    """What the process says of its cell.

    Raises
    ------
    ValueError, OSError
        If it says nothing that can be read.
    """
    try:
        with _open(folder / OUTCOME, _MOST_FACTS) as file:
            return _json.structure(json.loads(file.read(_MOST_FACTS)), Outcome)
    except (OSError, ValueError):
        raise
    except Exception as error:  # whatever cattrs raises
        raise ValueError("it holds no outcome") from error


def maps(path: Path, scene: Scene) -> Mapping[int, NDArray[np.float32]]:
    """The maps in a file, which must be those of a scene.

    Raises
    ------
    ValueError, OSError
        If they are not.
    """
    found = read_maps(path)
    shape = (scene.height, scene.width)
    for view, values in found.items():
        if not 0 <= view < scene.n or values.shape != shape:
            raise ValueError(f"the map of view {view} is {values.shape}, not {shape}")
    if scene.ref not in found:
        raise ValueError(f"there is no map of the reference view {scene.ref}")
    return found


def take(source: Path, target: Path) -> bool:
    """Copy a plain file, byte for byte; False where there is none of that name.

    It is copied and not moved: whoever made it may still hold it open.

    Raises
    ------
    ValueError, OSError
        If it is something else than a plain file, or too large.
    """
    try:
        file = _open(source, _MOST_FILE)
    except FileNotFoundError:
        return False
    with file, target.open("xb") as copy:
        while piece := file.read(_PIECE):
            copy.write(piece)
    return True


def _open(path: Path, most: int):  # type: ignore[no-untyped-def]
    """Open a file for reading without following a link or waiting at a pipe."""
    number = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    file = os.fdopen(number, "rb")
    facts = os.fstat(number)
    if not stat.S_ISREG(facts.st_mode) or facts.st_size > most:
        file.close()
        raise ValueError(f"{path.name} is no plain file of at most {most} bytes")
    return file


def corrected(found: Outcome, outside: float) -> Outcome:
    """An outcome whose seconds are believed as far as the keeper's own count agrees.

    Parameters
    ----------
    outside
        Seconds between the messages before and after the solve, by the keeper's clock.
    """
    if found.seconds is None:
        return found
    if abs(found.seconds - outside) <= SLACK + SHARE * outside:
        return found
    said = f"its process counted {found.seconds:.3g} s, its keeper {outside:.3g} s"
    return evolve(found, seconds=outside, doubt=said)


SLACK, SHARE = 0.05, 0.1
"""Seconds, and share of the time, by which the clocks of a process and of its keeper may differ.

A message takes well under a millisecond where a processor is free, and some tens of them where none is.
"""
