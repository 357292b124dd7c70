"""What new processes inherit: no main script of the user's, and the folder of compiled kernels."""

import os
import sys
from pathlib import Path

import pytest

from matbench.plans.plugins import kernel_cache
from matbench.scenes.catalogue import data_root
from matbench.solving.environment import kernel_cache_in_use, without_main


def test_without_a_home_kernels_are_not_kept_and_there_are_no_scenes(homeless, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with kernel_cache_in_use():
        assert data_root() is None
    assert list(tmp_path.iterdir()) == [], "no folder called ~"


@pytest.mark.parametrize("before", [None, "/somewhere/else"])
def test_kernels_are_shared_within_the_block_only(
    before: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    if before is not None:
        monkeypatch.setenv("NUMBA_CACHE_DIR", before)
    with kernel_cache_in_use():
        assert os.environ["NUMBA_CACHE_DIR"] == str(kernel_cache())
        assert kernel_cache().is_dir()
    assert os.environ.get("NUMBA_CACHE_DIR") == before


def test_where_no_folder_can_be_made_each_process_compiles_for_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    with kernel_cache_in_use():
        assert "NUMBA_CACHE_DIR" not in os.environ


def test_the_main_script_is_hidden_within_the_block_only() -> None:
    main = sys.modules["__main__"]
    with without_main():
        assert sys.modules["__main__"] is not main
        assert not hasattr(sys.modules["__main__"], "__file__")
    assert sys.modules["__main__"] is main
