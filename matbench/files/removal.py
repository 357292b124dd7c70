"""Removing what others have made: links, pipes, folders that nobody may enter, and folders deeper than a path is long.

`shutil.rmtree` calls itself for each floor, and fails in a folder of a thousand.
"""

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path

_AT_ONCE = 4096  # names: a folder may hold millions


def remove(path: Path) -> None:
    """Remove whatever lies under a name. A link is removed, not what it leads to. What cannot be removed stays."""
    with suppress(OSError):
        if not _unlinked(str(path)):
            with _entered(str(path)) as folder:
                _empty(folder)
            path.rmdir()


def _empty(top: int) -> None:
    """Empty an open folder: the folders in it are taken apart floor by floor, so that none is ever deep."""
    mark, number = secrets.token_hex(4), 0
    while names := _some_names(top):
        removed = 0
        for name in names:
            with suppress(OSError):
                if not _unlinked(name, top):
                    with _entered(name, top) as folder:
                        while inner := _some_names(folder):
                            for one in inner:
                                if not _unlinked(one, folder):
                                    number += 1
                                    os.rename(one, f".{mark}.{number}", src_dir_fd=folder, dst_dir_fd=top)
                    os.rmdir(name, dir_fd=top)
                removed += 1
        if not removed:
            return


def _unlinked(name: str, folder: int | None = None) -> bool:
    """Remove what is no folder; False if it is one.

    Raises
    ------
    OSError
        If it cannot be removed.
    """
    try:
        os.unlink(name, dir_fd=folder)
    except FileNotFoundError:
        return True
    except OSError:  # what it is called differs between systems
        if not stat.S_ISDIR(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
            raise
        return False
    return True


@contextmanager
def _entered(name: str, above: int | None = None) -> Iterator[int]:
    """A folder, open; its rights are set so that it can be emptied."""
    with suppress(OSError):
        os.chmod(name, 0o700, dir_fd=above)
    number = os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=above)
    try:
        yield number
    finally:
        os.close(number)


def _some_names(folder: int) -> list[str]:
    with os.scandir(folder) as entries:
        return [entry.name for entry in islice(entries, _AT_ONCE)]
