"""A method that looks for truth wherever a process can look, as a user's plug-in file.

It is told what to look for by a file that holds it reversed, so that what it looks for is nowhere in its memory unless
somebody else has put it there.
"""

import mmap
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench import Context, Estimate, Scene, load_scene
from matbench.files.own_folders import cache_folder

_CHUNK = 1 << 24
_OVERLAP = 4096


def _pages(size: int) -> tuple[mmap.mmap, NDArray[np.uint8], range]:
    """Memory of its own for what was read, and its addresses: what lies there is not to be found again."""
    pages = mmap.mmap(-1, size)
    array = np.frombuffer(pages, np.uint8)
    return pages, array, range(first := array.ctypes.data, first + size)


def _memory() -> Iterator[tuple[mmap.mmap, int]]:
    """All memory that this process could write to, reversed, but for where it is reversed; how many bytes.

    Nothing of it is copied elsewhere, as reversed copies of what it is told would be what it looks for.
    """
    turned, backwards, own = _pages(_CHUNK + _OVERLAP)
    _, forwards, too = _pages(_CHUNK + _OVERLAP)
    with Path("/proc/self/mem").open("rb", buffering=0) as memory:
        for line in Path("/proc/self/maps").read_text().splitlines():
            span, rights, *_ = line.split()
            if not rights.startswith("rw"):  # code, and what libraries only read
                continue
            first, last = (int(end, 16) for end in span.split("-"))
            for start in range(first, last, _CHUNK):
                with suppress(OSError, ValueError, OverflowError):
                    memory.seek(start)
                    count = memory.readinto(forwards[: min(_CHUNK + _OVERLAP, last - start)])
                    for place in (own, too):  # neighbours may be one span with it
                        forwards[max(0, place.start - start) : max(0, place.stop - start)] = 0
                    np.copyto(backwards[:count], forwards[:count][::-1])
                    yield turned, count


def _files() -> Iterator[tuple[bytes, int]]:
    """All open files, all in shared memory, and all that is kept for this user."""
    paths = [*Path("/proc/self/fd").iterdir(), *Path("/dev/shm").rglob("*"), *cache_folder().rglob("*")]  # noqa: S108
    for path in paths:
        with suppress(OSError):
            if stat.S_ISREG(path.stat().st_mode):
                content = path.read_bytes()[::-1]
                yield content, len(content)


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
        places = [(text := os.fsencode(value)[::-1], len(text)) for value in os.environ.values()]
        for reached, count in chain(places, _memory(), _files()):
            found |= {number for number, needle in enumerate(wanted) if reached.find(needle, 0, count) >= 0}
        values = np.full((scene.height, scene.width), len(found), np.float32)
        return Estimate({scene.ref: values}, work={"found": len(found), "wanted": len(wanted)})
