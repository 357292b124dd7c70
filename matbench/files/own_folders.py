"""The folders where this person's programs keep what is theirs, as the operating system has it.

On Linux these are ``~/.local/share`` and ``~/.cache``, or what ``XDG_DATA_HOME`` and ``XDG_CACHE_HOME`` name.
"""

import os
from pathlib import Path

from matbench.errors import UserError


def data_folder() -> Path:
    """Where `matbench fetch` puts scenes; it may not exist yet.

    Raises
    ------
    UserError
        If there is no home folder, and XDG_DATA_HOME names no other.
    """
    return _own("user_data_path", "give the folder of scenes by --data or MATBENCH_DATA, or set HOME or XDG_DATA_HOME")


def cache_folder() -> Path:
    """Where what can be made again is kept; it may not exist yet.

    Raises
    ------
    UserError
        If there is no home folder, and XDG_CACHE_HOME names no other.
    """
    return _own("user_cache_path", "set HOME, or XDG_CACHE_HOME to the absolute path of a folder")


def expanded(path: str | Path) -> Path:
    """A path in which ``~`` is replaced by the home folder.

    Raises
    ------
    UserError
        If there is no such home folder.
    """
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise UserError(f"{str(path)!r}: there is no such home folder; write the whole path") from None


def _own(kind: str, advice: str) -> Path:
    import platformdirs

    try:
        # older versions of platformdirs leave "~" in the path where there is no home folder: it would become
        # a folder of that name
        found: Path = getattr(platformdirs, kind)("matbench", appauthor=False).expanduser()
    except RuntimeError:
        raise UserError(f"there is no home folder: {advice}") from None
    if not found.is_absolute():
        raise UserError(f"{str(found)!r} is no absolute path, and would lie wherever one works: {advice}")
    return found


def forget_relative_home() -> None:
    """Have this process and those below it do as without HOME, if that is no absolute path.

    Libraries would else make folders for their caches wherever one works.
    """
    if not Path(os.environ.get("HOME", "/")).is_absolute():
        del os.environ["HOME"]
