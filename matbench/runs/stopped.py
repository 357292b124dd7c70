"""Runs that the system does not let go on: what is at fault, in one line."""

import os
from contextlib import suppress
from errno import EDQUOT, EFBIG, EIO, ENOSPC, EROFS, ESTALE
from pathlib import Path

from matbench.errors import UserError, cause

_STORAGE = (ENOSPC, EDQUOT, EFBIG, EIO, EROFS, ESTALE)  # of where files lie, also where none is named


class Stopped(UserError):
    """A run cannot go on, and not because of what was asked for: the system refuses something."""

    @classmethod
    def of(cls, folder: Path, error: OSError) -> "Stopped":
        """The error with what is at fault: the run folder only if it is so."""
        named = os.fsdecode(error.filename) if isinstance(error.filename, str | bytes) else ""
        if named and not _absolute(named).is_relative_to(_absolute(folder)):
            kind, what = Stopped, f"{named!r} cannot be used"
        elif named or error.errno in _STORAGE:
            kind, what = FolderLost, f"run folder {str(folder)!r} cannot be used"
        else:
            kind, what = Stopped, "the system refuses what the run needs"
        return kind(f"{what}: {cause(error)}. What is finished stays; mend this and go on")


class FolderLost(Stopped):
    """The run folder can no longer be written or read: the disk is full, or the network is gone."""


def _absolute(path: str | Path) -> Path:
    """A path from the root; as it is where the working folder has been deleted."""
    with suppress(FileNotFoundError):
        return Path(path).absolute()
    return Path(path)
