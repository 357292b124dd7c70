"""Imported by the fork server after the methods: it loads what is kept of their kernels, for all cells at once.

A cell in a process of its own would load them by itself, which takes it 0.1 s. Only kernels of the harness's own
methods are loaded, from files whose seal holds (`matbench.plans.kernel_cache`), and none is called here.
"""

import sys
from contextlib import suppress
from types import ModuleType
from typing import Any

OURS = "matbench.algorithms."


def load_kept(module: ModuleType) -> int:
    """Load all that is kept of the kernels that a module holds; how many it was."""
    from numba.core.dispatcher import Dispatcher

    from matbench.plans.kernel_cache import KernelCache

    kernels: list[Any] = [one for one in vars(module).values() if isinstance(one, Dispatcher)]
    loaded = 0
    for kernel in kernels:
        # one without an entry is called by other kernels only, and they hold its code
        if not isinstance(kernel._cache, KernelCache) or kernel.targetoptions.get("no_cpython_wrapper"):
            continue
        for signature in kernel._cache.signatures(kernel.targetctx):
            if signature not in kernel.overloads:
                kernel.compile(signature)
                loaded += 1
    return loaded


if "numba" in sys.modules:
    for _name in [name for name in sys.modules if name.startswith(OURS)]:
        with suppress(Exception):  # whatever is wrong, the cells find out by themselves
            load_kept(sys.modules[_name])
