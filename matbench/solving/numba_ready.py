"""Imported by the fork server before keepers are forked: numba knows its types and functions already.

numba learns them when the first kernel of a process is called or loaded, which takes 0.2 s of every cell that has a
process of its own. Nothing is compiled or loaded here, so no method's code runs.
"""

from contextlib import suppress

with suppress(Exception):  # whatever is wrong with numba, the first method that needs it says so
    import matbench.plans.kernel_cache  # noqa: F401  # before anything else of numba

    # isort: split
    from numba.core.registry import cpu_target

    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()
