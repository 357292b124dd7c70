"""Computed scenes on disk, from one run to the next: to read one takes a fraction of the time that it takes to make it.

They lie in the user's cache folder, ``scenes``, a file each, named by a digest over everything that decides it
(`key`). What cannot be read as it was written is made again, without a word; what cannot be written is not kept.

The files hold ground truth: a process that runs methods cannot see that folder (`matbench.solving.confinement`).
"""

import os
import platform
import re
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from json import dumps
from pathlib import Path

import matbench
from matbench.errors import UserError
from matbench.files.own_folders import cache_folder
from matbench.files.plain import NotPlain, open_plain
from matbench.files.writing import drafted
from matbench.scene import Scene
from matbench.scenes.packed import FORMAT, packed, unpacked

VARIABLE = "MATBENCH_CACHE_MB"
"""MiB that all of them may take together; 0 keeps none."""
DEFAULT_MB = 1024
"""About 600 worlds of 240x180 px with five views."""

_FOLDER = "scenes"
_OURS = re.compile(r"[0-9a-f]{64}\.scene|\.[0-9a-f]{64}\.scene\.[0-9a-f]{8}")  # the latter are drafts (`drafted`)
_SHARE = 8  # a scene may take this part of the room
_LEAST = 1 << 18  # bytes that each counts for at least: in a folder of very many files it takes long to look around
_FREE = 1 << 30  # bytes of the disk that are left to others
_RECENT = 3600  # seconds
_TICK = 0.05  # seconds by which the time of a file may lag behind the clock
# settings by which the libraries' results may differ in the last bit
_NUMBA = ("DISABLE_JIT", "CPU_NAME", "CPU_FEATURES", "ENABLE_AVX", "OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE")
_NUMPY = ("NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES")


def folder() -> Path | None:
    """Where they are kept; it may not exist yet. None for a person without a cache folder."""
    try:
        return cache_folder() / _FOLDER
    except UserError:
        return None


def room() -> int:
    """Bytes that they may take together.

    Raises
    ------
    UserError
        If the variable holds no whole number.
    """
    told = os.environ.get(VARIABLE, "") or str(DEFAULT_MB)
    if not re.fullmatch("[0-9]{1,9}", told):
        raise UserError(f"{VARIABLE} is {told!r}: it must be a whole number of MiB below 10^9; 0 keeps no scenes")
    return int(told) << 20


def key(sources: Iterable[Path], *asked: object) -> str | None:
    """What a scene is kept as: a digest over all that decides it.

    That is what was asked, the code and the data that it is made from, the versions of the libraries that compute it,
    and the processor and the settings for which they do.

    Parameters
    ----------
    sources
        The files with the code and the data.
    asked
        Texts, numbers, lists and dictionaries of them.

    Returns
    -------
    None where one of the files cannot be read, or has changed since this process began: then nobody knows whether it
    runs the code that lies there.
    """
    try:
        # first the digest and then the time: so what was read is what was there when this process began
        made_from = [(source.name, _digest(source), source.stat().st_ctime) for source in sources]
    except OSError:
        return None
    if any(changed > matbench._LOADED - _TICK for *_, changed in made_from):
        return None
    told = [asked, [named for *named, _ in made_from], _machine()]
    return sha256(dumps(told, sort_keys=True).encode()).hexdigest()


def scene(name: str | None, make: Callable[[], Scene]) -> Scene:
    """The scene that is kept under this name; else the one that `make` makes, which is kept from now on.

    Parameters
    ----------
    name
        What `key` says.

    Raises
    ------
    UserError
        As `room`.
    """
    there, most = folder(), room()
    if name is None or there is None or not most:
        return make()
    place = there / f"{name}.scene"
    with suppress(OSError, ValueError, MemoryError):
        return _read(place, name, most // _SHARE)
    made = make()
    with suppress(OSError, ValueError, MemoryError):
        # the larger part of its bytes, before they are put together
        if made.views.nbytes + sum(truth.nbytes for truth in made.truth.values()) <= most // _SHARE:
            _write(place, packed(made, name), most)
    return made


def _read(place: Path, name: str, most: int) -> Scene:
    """The scene in a file, which is then the one used last.

    Raises
    ------
    OSError, ValueError
        If there is none, or it is not as this user has written it.
    """
    with open_plain(place, most=most, follow=False) as file:
        facts = os.fstat(file.fileno())
        if facts.st_uid != os.getuid():
            raise NotPlain(f"{place.name} is another user's")
        content = file.read(facts.st_size)
        with suppress(OSError):
            os.utime(file.fileno())
    return unpacked(content, name)


def _write(place: Path, content: bytes, most: int) -> None:
    """Keep a scene, if there is room for it.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    if len(content) > most // _SHARE:
        return
    place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if _has_room(place.parent, len(content), most):
        with drafted(place, settled=False) as file:
            file.write(content)


def _has_room(there: Path, size: int, most: int) -> bool:
    """Is there room for one more? What was used least recently is removed for it, and what killed processes have left.

    What was used within the hour stays: of a set of scenes that is larger than the room, a part is then read in each of
    several runs. Else those that were read first would always make room for the others.
    """
    now, needed, kept = time.time(), max(size, _LEAST), list[tuple[float, int, str]]()
    with os.scandir(there) as entries:
        for entry in entries:
            if _OURS.fullmatch(entry.name):
                with suppress(FileNotFoundError):  # another process has removed it
                    facts = entry.stat(follow_symlinks=False)
                    kept.append((facts.st_mtime, max(facts.st_size, _LEAST), entry.path))
    taken = sum(each for _, each, _ in kept)
    for used, each, path in sorted(kept):
        is_recent, is_draft = abs(now - used) < _RECENT, Path(path).name.startswith(".")
        most_here = most if is_recent else -1 if is_draft else most - needed
        if taken > most_here and _removed(path):
            taken -= each
    space = os.statvfs(there)
    return taken + needed <= most and space.f_bavail * space.f_frsize - size > _FREE


def _removed(path: str) -> bool:
    """Remove a file; is it gone?"""
    try:
        Path(path).unlink(missing_ok=True)
    except OSError:
        return False
    return True


@cache
def _digest(source: Path) -> str:
    return sha256(source.read_bytes()).hexdigest()


def _machine() -> list[object]:
    """What computed numbers may depend on besides code and data."""
    import numba

    settings = [getattr(numba.config, name, None) for name in _NUMBA]
    return [FORMAT, _libraries(), _processor(), settings, [os.environ.get(name) for name in _NUMPY]]


@cache
def _libraries() -> list[object]:
    """The versions of what is loaded, which may not be what is installed by now."""
    import llvmlite
    import numba
    import numpy
    import scipy

    return [sys.version, *(library.__version__ for library in (llvmlite, numba, numpy, scipy))]


@cache
def _processor() -> list[object]:
    """What the processor can do, and the library of functions such as `exp`."""
    from llvmlite import binding

    features, library = "", ""
    with suppress(RuntimeError):
        features = binding.get_host_cpu_features().flatten()
    with suppress(OSError, ValueError):
        library = os.confstr("CS_GNU_LIBC_VERSION") or ""
    return [platform.machine(), binding.get_host_cpu_name(), features, library]
