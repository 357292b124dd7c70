"""Limits as people write them."""

import os

import pytest

from matbench.errors import UserError
from matbench.plans import limits
from matbench.plans.settings import Settings


def test_limits_as_people_write_them() -> None:
    assert limits.mebibytes("4G") == limits.mebibytes("4 GiB") == limits.mebibytes(4096) == 4096
    assert limits.mebibytes("1.5g") == 1536
    assert limits.seconds("0.5") == 0.5
    assert limits.seconds("none") is None
    with pytest.raises(UserError, match="jobs"):
        Settings(jobs=2.5)  # type: ignore[arg-type]
    assert limits.crowded(limits.cores(), 1) == ""
    assert f"share {limits.cores()} cores" in limits.crowded(limits.cores(), 2)
    assert os.cpu_count()
