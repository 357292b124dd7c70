"""What the processes that solve find around them: no user's script, and a place for compiled kernels."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import ModuleType

from matbench.errors import UserError
from matbench.plans import plugins


@contextmanager
def without_main() -> Iterator[None]:
    """Keep child processes from running the user's script again: nothing that they do lies in it."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def kernels_kept() -> Iterator[None]:
    """Let the processes started meanwhile keep compiled kernels where no other code's are."""
    before = os.environ.get("NUMBA_CACHE_DIR")
    with suppress(OSError, UserError):  # without a folder to keep them in, kernels are compiled anew
        place = plugins.kernel_cache()
        place.mkdir(parents=True, exist_ok=True)
        os.environ["NUMBA_CACHE_DIR"] = str(place)
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("NUMBA_CACHE_DIR", None)
        else:
            os.environ["NUMBA_CACHE_DIR"] = before
