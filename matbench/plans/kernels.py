"""Where compiled kernels are kept: below the user's cache folder, or for as long as this process lives.

How numba reads and writes them there is in `matbench.plans.kernel_cache`.
"""

import atexit
import os
import warnings
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from tempfile import TemporaryFile

from matbench.errors import UserError
from matbench.files.own_folders import cache_folder
from matbench.files.temporary import temporary_folder

VARIABLE = "NUMBA_CACHE_DIR"
_ROOM = 4 << 20  # bytes: about what the kernels of all built-in methods take


def place(name: str) -> Path:
    """A folder of that name in which kernels can be kept; it is there, and can be written to.

    It is below the user's cache folder. Where nothing can be kept there, it is a temporary one, which goes when this
    process ends: then kernels are compiled once a run. The first time, a warning says so.
    """
    handed_on = Path(os.environ.get(VARIABLE, ""))
    if handed_on.name == name and handed_on.is_dir():  # found by a process above this one
        return handed_on
    try:
        found = cache_folder() / "kernels" / name
        found.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=found) as file:
            file.write(bytes(_ROOM))
        return found
    except UserError as error:
        why = str(error)
    except OSError as error:
        why = f"{error.filename or found}: {error.strerror}"
    if aside() is None:
        warnings.warn(f"compiled kernels are not kept, each run compiles its own: {why}", stacklevel=2)
    found = _temporary() / name
    found.mkdir(parents=True, exist_ok=True)
    return found


def aside() -> Path | None:
    """The folder that this process uses instead of the user's cache folder; None while that does."""
    return _temporary() if _temporary.cache_info().currsize else None


@cache
def _temporary() -> Path:
    """The temporary folder of this process: one, as a fork server keeps the folder that it was started with."""
    kept = ExitStack()
    atexit.register(kept.close)
    return kept.enter_context(temporary_folder())
