"""What a new process inherits: the main script that it would run again, variables, where compiled kernels are kept."""

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import ModuleType

from matbench.plans import kernels, plugins


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
def variables(values: Mapping[str, str]) -> Iterator[None]:
    """Within the block, these variables are set for processes that are started."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def kernel_cache_in_use() -> Iterator[None]:
    """Have processes started in this block share compiled kernels, in a folder for this state of the code.

    numba notices a changed source file, but not a changed file that this one imports. A folder for each
    state of the code keeps it from loading a kernel that was compiled from other code.

    Where the user's cache folder cannot be used, matplotlib is given a place, too: each process would else make one of
    its own, and those that are killed would leave it.
    """
    changed = {kernels.VARIABLE: str(plugins.kernel_cache())}
    if (aside := kernels.aside()) is not None:
        changed["MPLCONFIGDIR"] = os.environ.get("MPLCONFIGDIR") or str(aside / "matplotlib")
    with variables(changed):
        yield
