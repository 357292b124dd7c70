"""The folders where this person's programs keep what is theirs, as the operating system has it.

On Linux these are ``~/.local/share`` and ``~/.cache``, or what ``XDG_DATA_HOME`` and ``XDG_CACHE_HOME`` name.
"""

from pathlib import Path

from matbench.errors import UserError


def data_folder() -> Path:
    """Where `matbench fetch` puts scenes; it may not exist yet.

    Raises
    ------
    UserError
        If there is no home folder, and XDG_DATA_HOME names no other.
    """
    return _own("user_data_path", "scenes", "XDG_DATA_HOME")


def cache_folder() -> Path:
    """Where compiled kernels are kept; it may not exist yet.

    Raises
    ------
    UserError
        If there is no home folder, and XDG_CACHE_HOME names no other.
    """
    return _own("user_cache_path", "compiled kernels", "XDG_CACHE_HOME")


def _own(kind: str, what: str, variable: str) -> Path:
    import platformdirs

    try:
        found: Path = getattr(platformdirs, kind)("matbench", appauthor=False)
        # older versions of platformdirs leave "~" in the path where there is no home folder: it would become
        # a folder of that name
        return found.expanduser()
    except RuntimeError:
        raise UserError(
            f"there is no home folder for {what}: set HOME, or {variable} to the absolute path of a folder"
        ) from None
