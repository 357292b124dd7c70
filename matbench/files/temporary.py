"""Temporary folders that go even if their process is killed: the next one that starts removes them.

Each is locked by its process. The system unlocks it when that ends, however it ends.
"""

import os
import re
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fcntl import LOCK_EX, LOCK_NB, flock
from pathlib import Path

from matbench.files.removal import remove

_NEW, _HELD = "matbench-new-", "matbench-held-"
_DRAWN = "[a-z0-9_]{8}"  # what `mkdtemp` adds


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A new folder that this user alone may enter; it is removed when the block ends."""
    place = Path(tempfile.mkdtemp(prefix=_NEW))
    number = os.open(place, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # where nothing can be locked, nothing is removed later
            flock(number, LOCK_EX | LOCK_NB)
            # only now under the name that `sweep` looks for: before, it would take it for one that was left
            place = place.rename(place.with_name(place.name.replace(_NEW, _HELD)))
        yield place
    finally:
        remove(place)
        os.close(number)


def sweep() -> None:
    """Remove the temporary folders of this user whose processes have ended, and what lies in their place."""
    with suppress(OSError):
        for place in Path(tempfile.gettempdir()).glob(f"{_HELD}*"):
            with suppress(OSError):
                facts = place.lstat()
                is_ours = facts.st_uid == os.getuid() and re.fullmatch(_HELD + _DRAWN, place.name)
                if is_ours and not stat.S_ISDIR(facts.st_mode):
                    place.unlink()
            with suppress(OSError), _opened(place) as number:
                if os.fstat(number).st_uid == os.getuid():
                    flock(number, LOCK_EX | LOCK_NB)  # an error if a process holds it
                    remove(place)


@contextmanager
def _opened(place: Path) -> Iterator[int]:
    number = os.open(place, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        yield number
    finally:
        os.close(number)
