"""Fixtures for tests of all parts."""

import os
from pathlib import Path

import pytest

from matbench.plugins import kernel_cache

# numba does not notice changes of what a kernel calls in another file: each state of the code has its own cache
os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))


@pytest.fixture(scope="session")
def data_root() -> Path:
    """The folder of real scenes; without one, tests on real scenes skip and say so."""
    named = os.environ.get("MATBENCH_DATA")
    if not named:
        pytest.skip("MATBENCH_DATA is not set: no real scenes")
    root = Path(named).expanduser()
    if not root.is_dir():
        pytest.fail(f"MATBENCH_DATA names {str(root)!r}, which is no folder")
    return root.resolve()
