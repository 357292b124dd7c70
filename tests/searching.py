"""A method that looks for truth wherever a process can look, as a user's plug-in file.

It is told what to look for by a file that holds it reversed, so that what it looks for is nowhere in its memory unless
somebody else has put it there.
"""

import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
from attrs import frozen

from matbench import Context, Estimate, Scene, load_scene

_CHUNK = 1 << 24
_OVERLAP = 4096


def _memory() -> Iterator[bytes]:
    """All memory that this process could write to, reversed, so that no copy of what is found comes into being."""
    with Path("/proc/self/mem").open("rb", buffering=0) as memory:
        for line in Path("/proc/self/maps").read_text().splitlines():
            span, rights, *_ = line.split()
            if not rights.startswith("rw"):  # code, and what libraries only read
                continue
            first, last = (int(end, 16) for end in span.split("-"))
            for start in range(first, last, _CHUNK):
                with suppress(OSError, ValueError, OverflowError):
                    memory.seek(start)
                    found = memory.read(min(_CHUNK + _OVERLAP, last - start))
                    yield np.frombuffer(found, np.uint8)[::-1].tobytes()


def _files() -> Iterator[bytes]:
    """All open files, and all in shared memory."""
    paths = [*Path("/proc/self/fd").iterdir(), *Path("/dev/shm").rglob("*")]  # noqa: S108
    for path in paths:
        with suppress(OSError):
            if stat.S_ISREG(path.stat().st_mode):
                yield np.frombuffer(path.read_bytes(), np.uint8)[::-1].tobytes()


@frozen
class Searches:
    """Counts how much of what it is to look for is within its reach.

    Parameters
    ----------
    needles
        File with what to look for, each of `length` bytes, reversed.
    plant
        Put it all into its own memory first: then it must be found.
    loads
        Load the scene by its name through the library before the search.
    """

    needles: str
    length: int
    plant: bool = False
    loads: bool = False

    def solve(self, scene: Scene, context: Context) -> Estimate:
        held: list[object] = []
        if self.loads:
            loaded = load_scene(scene.name)
            held.append(loaded)
            if loaded.truth or loaded.regions or loaded.visible or loaded.held_out is not None:
                raise RuntimeError("a scene that was loaded by name came with its truth")
        if scene.width <= 64:  # the warm-up
            return Estimate({scene.ref: np.full((scene.height, scene.width), 1, np.float32)})
        told = Path(self.needles).read_bytes()
        wanted = [told[at : at + self.length] for at in range(0, len(told), self.length)]
        if self.plant:
            held.append([np.frombuffer(needle, np.uint8)[::-1].copy() for needle in wanted])
        found = set()
        places = [os.fsencode(value)[::-1] for value in os.environ.values()]
        for reached in (*places, *_memory(), *_files()):
            found |= {number for number, needle in enumerate(wanted) if needle in reached and reached is not told}
        # `told` and `wanted` hold the needles reversed, and reversed once more they are what `_memory` sees of them
        values = np.full((scene.height, scene.width), len(found), np.float32)
        return Estimate({scene.ref: values}, work={"found": len(found), "wanted": len(wanted)})
