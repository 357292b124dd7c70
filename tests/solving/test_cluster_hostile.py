"""A real cluster with a worker that answers with programs: none of them runs in the client."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from machines import Machines
from places import METHODS, TESTS
from tools import need
from waiting import wait_until

from matbench import comparison
from matbench.errors import UserError
from matbench.plans.settings import Settings

SCENE = "synthetic/box[size=48x36]"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machines]:
    """A cluster of one worker, which answers as the file ``way`` in its folder says."""
    need("dask")
    found = Machines(tmp_path_factory.mktemp("machines"))
    found.add("--no-nanny", "--preload", str(TESTS / "hostile_worker.py"))
    wait_until(found.pids)
    found.client.close()  # it would believe what comes
    yield found
    found.close()


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("reply", r"the cluster tcp://.* sent a program, (posix\.mkdir|.*hostile_worker\.Running), which was not run"),
        ("large", r"the cluster tcp://.* sent a program, posix\.mkdir, which was not run"),
        ("other", "a worker's answer cannot be used: a worker answered with dict, not with bytes"),
        ("error", "no worker finished it"),
        ("event", r"the cluster tcp://.* sent a program, posix\.mkdir, which was not run"),
        ("warning", r"the cluster tcp://.* sent a program, posix\.mkdir, which was not run"),
    ],
)
def test_nothing_that_a_worker_sends_runs_in_the_client(
    hostile: Machines, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str, words: str
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    (hostile.folder / "way").write_text(way)
    ready = comparison.prepare(
        "flat", SCENE, out=tmp_path / "run", plugin=METHODS, settings=Settings(dask=hostile.address, timeout=60)
    )
    try:
        ready.run()
    except UserError as error:
        said = str(error)
    else:
        (said,) = ready.tables().cells.reason
    assert re.search(words, said), said
    assert not (tmp_path / "here" / "it-ran").exists()
