"""What a process that ran a method has left in its folder: checked by the keeper, and made a cell.

Nothing there is believed: files must be plain ones of a bounded size, maps must have the scene's shape, and what the
keeper has counted itself, seconds above all, does not come from there.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from attrs import evolve
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.files.documents import read_json
from matbench.files.plain import open_plain
from matbench.runs.cell_files import MOST_FACTS, read_confidence, read_maps
from matbench.runs.outcome import Outcome
from matbench.scene import Scene
from matbench.solving.worker import OUTCOME

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
        found = _json.structure(read_json(folder / OUTCOME, most=MOST_FACTS, follow=False), Outcome)
    except (OSError, ValueError):
        raise
    except Exception as error:  # whatever cattrs raises
        raise ValueError("it holds no outcome") from error
    if wrong := found.implausible:
        raise ValueError(f"it claims {wrong}")
    return found


def maps(path: Path, scene: Scene) -> Mapping[int, NDArray[np.float32]]:
    """The maps in a file, which must be those of a scene.

    Raises
    ------
    ValueError, OSError
        If they are not.
    """
    return _of_scene(read_maps(path, (scene.height, scene.width), follow=False), scene)


def _of_scene(found: Mapping[int, NDArray[np.float32]], scene: Scene) -> Mapping[int, NDArray[np.float32]]:
    if wrong := [view for view in found if not 0 <= view < scene.n]:
        raise ValueError(f"there is a map of view {wrong[0]}, the scene has the views 0 to {scene.n - 1}")
    if scene.ref not in found:
        raise ValueError(f"there is no map of the reference view {scene.ref}")
    return found


def confidence(path: Path, scene: Scene) -> Mapping[int, NDArray[np.float32]]:
    """The confidence maps in a file, which must be those of a scene.

    Raises
    ------
    ValueError, OSError
        If they are not.
    """
    return _of_scene(read_confidence(path, (scene.height, scene.width), follow=False), scene)


def take(source: Path, target: Path) -> bool:
    """Copy a plain file, byte for byte; False where there is none of that name.

    It is copied and not moved: whoever made it may still hold it open.

    Raises
    ------
    ValueError, OSError
        If it is something else than a plain file, or too large.
    """
    try:
        file = open_plain(source, most=_MOST_FILE, follow=False)
    except FileNotFoundError:
        return False
    with file, target.open("xb") as copy:
        while piece := file.read(_PIECE):
            copy.write(piece)
    return True


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
