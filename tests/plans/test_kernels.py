"""Where compiled kernels are kept: below the person's cache, one folder for each state of the code."""

from pathlib import Path

import pytest

from matbench.errors import UserError
from matbench.plans import kernels
from matbench.plans.plugins import kernel_cache


def test_kernels_lie_below_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert kernels.home() == tmp_path / "matbench" / "kernels"
    assert kernel_cache().parent == tmp_path / "matbench" / "kernels"
    assert list(tmp_path.iterdir()) == [], "asking makes nothing"


def test_without_a_home_it_is_said_what_to_set(homeless: None) -> None:
    with pytest.raises(UserError, match="no home folder for compiled kernels: set HOME, or XDG_CACHE_HOME"):
        kernels.home()
