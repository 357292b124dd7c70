"""What new processes inherit: no main script of the user's, and the folder of compiled kernels."""

import os
import sys
import warnings
from pathlib import Path

import pytest
from forking import in_child

from matbench.plans.plugins import kernel_cache
from matbench.scenes.catalogue import data_root
from matbench.solving.environment import kernel_cache_in_use, without_main


def test_without_a_home_there_is_a_place_all_the_same_and_there_are_no_scenes(
    homeless, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MPLCONFIGDIR", raising=False)

    def act() -> list[bool]:
        warnings.simplefilter("ignore")
        with kernel_cache_in_use():
            places = [Path(os.environ["NUMBA_CACHE_DIR"]), Path(os.environ["MPLCONFIGDIR"])]
            assert data_root() is None
            return [place.parent.is_dir() for place in places]

    assert in_child(act) == [True, True]
    assert list(tmp_path.iterdir()) == [], "no folder called ~"


@pytest.mark.parametrize("before", [None, "/somewhere/else"])
def test_kernels_are_shared_within_the_block_only(
    before: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for name in ("NUMBA_CACHE_DIR", "MPLCONFIGDIR"):
        monkeypatch.delenv(name, raising=False)
    if before is not None:
        monkeypatch.setenv("NUMBA_CACHE_DIR", before)
    with kernel_cache_in_use():
        assert os.environ["NUMBA_CACHE_DIR"] == str(kernel_cache())
        assert kernel_cache().is_dir()
        assert "MPLCONFIGDIR" not in os.environ, "the person's own is used"
    assert os.environ.get("NUMBA_CACHE_DIR") == before


def test_the_main_script_is_hidden_within_the_block_only() -> None:
    main = sys.modules["__main__"]
    with without_main():
        assert sys.modules["__main__"] is not main
        assert not hasattr(sys.modules["__main__"], "__file__")
    assert sys.modules["__main__"] is main
