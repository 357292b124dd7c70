"""What a new process inherits: which main script it would run again, and where compiled kernels are kept."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import ModuleType

from matbench.errors import UserError
from matbench.plans import plugins


@contextmanager
def without_main() -> Iterator[None]:
    """Hide the user's main script from processes started in this block.

    A new process of `multiprocessing` imports the main script again before anything else. A script that calls
    `matbench.compare` at its top level would then start another comparison in every process. Nothing
    that these processes do is defined in that script.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def kernel_cache_in_use() -> Iterator[None]:
    """Have processes started in this block share compiled kernels, in a folder for this state of the code.

    numba notices a changed source file, but not a changed file that this one imports. A folder for each
    state of the code keeps it from loading a kernel that was compiled from other code.
    """
    before = os.environ.get("NUMBA_CACHE_DIR")
    with suppress(OSError, UserError):  # where no folder can be made, each process compiles its kernels itself
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
