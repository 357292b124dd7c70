"""What a method must not find, and a method that looks for it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from places import TESTS

from matbench import Scene

SEARCHING = TESTS / "searching.py"


LENGTH = 192  # bytes


def _windows(values: NDArray[np.generic]) -> Iterator[bytes]:
    """Pieces of an array that hold many different bytes, so that nothing else has the same by chance."""
    for row in values.reshape(-1, values.shape[-1]):
        content = np.ascontiguousarray(row).tobytes()
        pieces = [content[at : at + LENGTH] for at in range(0, len(content) - LENGTH + 1, LENGTH)]
        yield from (piece for piece in pieces if len(set(piece)) > 40)


def needles(scene: Scene) -> list[bytes]:
    """What a method must not find: truth of all views, and the view that is held out."""
    secrets = [*scene.truth.values()]
    if scene.held_out is not None:
        secrets.append(scene.held_out.image.reshape(scene.height, -1))
    seen = scene.views.tobytes()
    pieces = [[piece for piece in dict.fromkeys(_windows(secret)) if piece not in seen] for secret in secrets]
    found = [piece for some in pieces for piece in some[:: max(1, len(some) // 4)][:4]]
    assert len(found) >= 4, "too little to look for"
    return found


def looking_for(tmp_path: Path, scene: Scene, options: str = "") -> str:
    """The method that looks for what it must not find of a scene."""
    told = tmp_path / "needles"
    told.write_bytes(b"".join(piece[::-1] for piece in needles(scene)))
    return f"searches[needles={told} length={LENGTH} {options}]"
