"""Small scenes to keep on disk."""

from pathlib import Path

import numpy as np

from matbench.scene import Range, Scene
from matbench.scenes import kept

KEY = "5" * 64


def scene_of(number: int, height: int = 6) -> Scene:
    rng = np.random.default_rng(number)
    views = rng.integers(0, 256, (2, height, 8, 3), np.uint8)
    truth = rng.random((height, 8), np.float32)
    return Scene(f"toy/{number}", views, ("0", "1"), 0, Range(0, 4), {0: truth}, 1, {"all": truth > 0.5})


def got(number: int = 1, key: str = KEY, height: int = 6) -> bool:
    """Is a scene read, and not made? Either way it must be the right one."""
    made = []

    def make() -> Scene:
        made.append(number)
        return scene_of(number, height)

    found, wanted = kept.scene(key, make), scene_of(number, height)
    assert (found.name, found.digest, found.truth_digest) == (wanted.name, wanted.digest, wanted.truth_digest)
    return not made


def keys(count: int) -> list[str]:
    return [f"{number:064x}" for number in range(count)]


def held(there: Path) -> set[str]:
    return {path.name for path in there.iterdir()}
