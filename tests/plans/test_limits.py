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
    with pytest.raises(UserError, match="is not a positive number"):
        limits.seconds(10**400)
    with pytest.raises(UserError, match="jobs"):
        Settings(jobs=2.5)  # type: ignore[arg-type]
    assert limits.crowded(limits.cores(), 1) == ""
    assert f"share {limits.cores()} cores" in limits.crowded(limits.cores(), 2)
    assert os.cpu_count()


@pytest.mark.parametrize("address", ["local", "tcp://127.0.0.1:8786", "tls://[::1]:8786", "cluster.example.org:8786"])
def test_a_scheduler_is_local_or_an_address(address: str) -> None:
    assert Settings(dask=address).dask == address
    assert Settings().dask is None


@pytest.mark.parametrize("address", ["nonsense", "", "tcp://", "tcp://[", "tcp://host", "tcp://host:port", "host:0"])
def test_what_is_no_scheduler_is_refused(address: str) -> None:
    with pytest.raises(UserError, match=r"is no address: write tcp://HOST:PORT of one that runs, or local"):
        Settings(dask=address)
