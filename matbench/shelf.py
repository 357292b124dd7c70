"""Scenes of a run by name: as many in memory as there is room for; others are put aside on disk until they are needed.

They lie in a file without a name, as hidden as this process's memory, which goes with it. What the disk has no
room for is loaded, or rendered, again.
"""

import os
import pickle
import zlib
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from tempfile import TemporaryFile
from typing import IO, Any

from attrs import evolve, fields, frozen

from matbench.errors import UserError
from matbench.scene import Scene

ROOM = 1 << 29
"""Bytes: about 150 worlds of 240x180 px, or half a light field of 81 views."""


@frozen
class Facts:
    """What stays known of a scene that is not in memory.

    Parameters
    ----------
    digest, truth_digest, metrics
        As of `Scene`.
    size
        Height and width, px.
    remark
        A remark on it for readers of the scores; empty if there is none.
    """

    digest: str
    truth_digest: str
    metrics: str
    size: tuple[int, int]
    remark: str = ""

    @classmethod
    def of(cls, scene: Scene, remark: str = "") -> "Facts":
        return cls(scene.digest, scene.truth_digest, scene.metrics, (scene.height, scene.width), remark)


def bytes_of(scene: Scene) -> int:
    """How many bytes the arrays of a scene take."""
    known = sum(part.nbytes for of in (scene.truth, scene.regions, scene.visible) for part in of.values())
    return scene.views.nbytes + known + (0 if scene.held_out is None else scene.held_out.image.nbytes)


@frozen(eq=False)
class _Aside:
    """Where a scene lies that was put aside: a file, and the bytes in it."""

    file: IO[bytes]
    begin: int
    size: int

    @classmethod
    def put(cls, scene: Scene, file: IO[bytes]) -> "_Aside":
        """Write a scene at the end of a file."""
        held: dict[str, Any] = {one.name: getattr(scene, one.name) for one in fields(Scene)}
        plain = {name: dict(value) if isinstance(value, Mapping) else value for name, value in held.items()}
        content = zlib.compress(pickle.dumps(plain, protocol=5), 1)
        begin = file.seek(0, 2)
        file.write(content)
        file.flush()
        return cls(file, begin, len(content))

    def scene(self) -> Scene:
        """Read it again."""
        content = os.pread(self.file.fileno(), self.size, self.begin)
        held = pickle.loads(zlib.decompress(content))  # noqa: S301 -- nobody else can write there
        if held["held_out"] is not None:
            held["held_out"] = evolve(held["held_out"])  # its array is read-only again
        return Scene(**held)


class Shelf(Mapping[str, Scene]):
    """Name -> scene. Those asked for least recently are put aside when the others take more than `room`.

    Parameters
    ----------
    load
        Loads a scene by its name.
    room
        Bytes. One scene stays, however large.
    """

    def __init__(self, load: Callable[[str], Scene], room: int = ROOM) -> None:
        self._load, self._room = load, room
        self._facts: dict[str, Facts] = {}
        self._held: OrderedDict[str, Scene] = OrderedDict()
        self._taken = 0
        self._aside: dict[str, _Aside] = {}
        self._file: IO[bytes] | None = None

    @property
    def facts(self) -> Mapping[str, Facts]:
        """Name -> facts, in the order of the scenes; nothing is loaded."""
        return self._facts

    def put(self, scene: Scene, remark: str = "") -> None:
        """Add a scene."""
        self._facts[scene.name] = Facts.of(scene, remark)
        self._aside.pop(scene.name, None)
        self._hold(scene)

    def held(self, name: str) -> Scene | None:
        """The scene, if it need not be loaded."""
        if (scene := self._held.get(name)) is None and name in self._aside:
            with suppress(OSError, zlib.error, pickle.UnpicklingError):  # a disk that fails: it is loaded
                scene = self._aside[name].scene()
                self._hold(scene)
        return scene

    def only(self, names: Collection[str]) -> "Shelf":
        """A shelf with these of the scenes; nothing is loaded."""
        found = Shelf(self._load, self._room)
        for name in self:
            if name in names:
                found.take(self, name)
        return found

    def take(self, other: "Shelf", name: str) -> None:
        """Add a scene of another shelf, which is loaded no sooner than it is needed."""
        self._facts[name] = other._facts[name]
        if (aside := other._aside.get(name)) is not None:
            self._aside[name] = aside
        if (scene := other._held.get(name)) is not None:
            self._hold(scene)

    def __getitem__(self, name: str) -> Scene:
        """The scene.

        Raises
        ------
        UserError
            If it cannot be loaded again, or has changed since.
        """
        known = self._facts[name]
        scene = self.held(name)
        if scene is None:
            scene = self._load(name)
            if (scene.digest, scene.truth_digest) != (known.digest, known.truth_digest):
                raise UserError(f"{name} is not what it was when the run began")
            self._hold(scene)
        self._held.move_to_end(name)
        return scene

    def __contains__(self, name: object) -> bool:
        return name in self._facts

    def __iter__(self) -> Iterator[str]:
        return iter(self._facts)

    def __len__(self) -> int:
        return len(self._facts)

    def _hold(self, scene: Scene) -> None:
        if scene.name in self._held:
            self._taken -= bytes_of(self._held.pop(scene.name))
        self._held[scene.name] = scene
        self._taken += bytes_of(scene)
        while self._taken > self._room and len(self._held) > 1:
            gone = self._held.popitem(last=False)[1]
            self._taken -= bytes_of(gone)
            self._put_aside(gone)

    def _put_aside(self, scene: Scene) -> None:
        if scene.name in self._aside:
            return
        with suppress(OSError):  # there is no room, or no place, for it: it is loaded again
            self._file = self._file or TemporaryFile()  # noqa: SIM115 -- it is open as long as this shelf is there
            self._aside[scene.name] = _Aside.put(scene, self._file)


def facts_of(scenes: Mapping[str, Scene]) -> Mapping[str, Facts]:
    """Name -> facts of scenes, on a shelf or not."""
    return scenes.facts if isinstance(scenes, Shelf) else {name: Facts.of(scene) for name, scene in scenes.items()}


def held(scenes: Mapping[str, Scene], name: str) -> Scene | None:
    """The scene, if there is one of that name that need not be loaded."""
    return scenes.held(name) if isinstance(scenes, Shelf) else scenes.get(name)


def only(scenes: Mapping[str, Scene], names: Collection[str]) -> Mapping[str, Scene]:
    """Those of the scenes that have one of these names."""
    if isinstance(scenes, Shelf):
        return scenes.only(names)
    return {name: scene for name, scene in scenes.items() if name in names}
