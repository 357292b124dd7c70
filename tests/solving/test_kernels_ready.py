"""Kernels that are kept are loaded before cells are forked: not compiled, not called, and only those with an entry."""

import sys
from pathlib import Path
from types import ModuleType

import numba
import numpy as np
import pytest

from matbench.plans import kernel_cache
from matbench.solving.kernels_ready import load_kept

TEXT = """
from numba import njit

@njit(cache=True, no_cpython_wrapper=True)
def inner(x):
    return 2 * x

@njit(cache=True)
def outer(x):
    return inner(x) + 1

not_a_kernel = 3
"""


def imported(path: Path) -> ModuleType:
    module = ModuleType("made_ready")
    module.__file__ = str(path)
    exec(compile(path.read_text(), path, "exec"), vars(module))  # noqa: S102 -- the text above
    return module


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "kernels").mkdir()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))  # numba reads it again where it has changed
    (tmp_path / "made_ready.py").write_text(TEXT)
    return tmp_path / "made_ready.py"


def test_all_that_is_kept_is_loaded_and_nothing_else(path: Path) -> None:
    first = imported(path)
    assert load_kept(first) == 0, "nothing is kept yet"
    assert (first.outer(1), first.outer(1.5)) == (3, 4.0)
    again = imported(path)
    assert load_kept(again) == 2
    assert load_kept(again) == 0, "they are there"
    assert not again.inner.overloads
    before = dict(again.outer.stats.cache_misses)
    assert (again.outer(2), again.outer(2.5)) == (5, 6.0)
    assert dict(again.outer.stats.cache_misses) == before == {}


def test_what_is_damaged_does_no_harm(path: Path) -> None:
    assert imported(path).outer(1) == 3
    for file in path.parent.glob("kernels/*/*.nbc"):
        file.write_bytes(file.read_bytes()[:-1] + b"?")
    again = imported(path)
    load_kept(again)
    assert again.outer(1) == 3


def test_a_kernel_of_ours_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from matbench.algorithms import weighted_median

    kernels = [one for one in vars(weighted_median).values() if hasattr(one, "py_func")]
    assert any(isinstance(one._cache, kernel_cache.KernelCache) for one in kernels)
    monkeypatch.delitem(sys.modules, "matbench.solving.kernels_ready")
    import matbench.solving.kernels_ready  # noqa: F401 -- imported anew it does its work without a word

    assert np is not None
