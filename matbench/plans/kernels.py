"""Where kernels that numba has compiled are kept."""

from pathlib import Path

from matbench.files.own_folders import cache_folder


def home() -> Path:
    """The folder of all compiled kernels, inside the user's cache folder.

    Raises
    ------
    UserError
        If there is no home folder.
    """
    return cache_folder() / "kernels"
