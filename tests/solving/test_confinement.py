"""What a process that runs methods can reach."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from forking import beside

from matbench.solving import confinement
from matbench.solving.confinement import SHARED_MEMORY, shared_memory_mb, shut_in

if not confinement.is_possible():
    pytest.skip("this system lets nobody mount in a namespace of their own", allow_module_level=True)


def in_a_process(work: Callable[[], bool]) -> bool:
    """What a copy of this process finds."""
    pid = os.fork()
    if not pid:
        found = False
        try:
            found = work()
        finally:
            os._exit(0 if found else 1)
    return os.waitpid(pid, 0)[1] == 0


def test_the_folder_can_be_read_and_not_written(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "cell.json").write_text("{}")

    def is_confined() -> bool:
        assert confinement.shut_in(tmp_path / "run", 10)
        (tmp_path / "beside.txt").write_text("elsewhere it writes as before")
        assert (tmp_path / "run" / "cell.json").read_text() == "{}"
        for change in (
            lambda: (tmp_path / "run" / "cell.json").write_text("[]"),
            lambda: (tmp_path / "run" / "new").touch(),
            lambda: (tmp_path / "run" / "cell.json").unlink(),
            lambda: (tmp_path / "run").rename(tmp_path / "away"),
        ):
            try:
                change()
            except OSError:
                continue
            return False
        return True

    assert in_a_process(is_confined)
    assert (tmp_path / "run" / "cell.json").read_text() == "{}"
    assert (tmp_path / "beside.txt").exists()
    (tmp_path / "run" / "cell.json").write_text("this process writes as before")


def test_shared_memory_is_its_own_and_bounded(tmp_path: Path) -> None:
    name = Path(confinement.SHARED_MEMORY, f"matbench-test-{os.getpid()}")

    def is_bounded() -> bool:
        assert confinement.shut_in(tmp_path, 4)
        name.write_bytes(bytes(2 << 20))
        held = confinement.shared_memory_mb(os.getpid())
        try:
            name.write_bytes(bytes(8 << 20))
        except OSError:
            return held is None or held == 2  # None: seen from inside it is everybody's
        return False

    assert in_a_process(is_bounded)
    assert not name.exists()


def refused(act) -> str:
    try:
        act()
    except OSError as error:
        return error.strerror or ""
    return "it worked"


def test_shared_memory_is_its_own_bounded_and_counted(tmp_path: Path) -> None:
    name = Path(SHARED_MEMORY) / f"matbench-test-{os.getpid()}"

    def inside() -> str:
        assert shut_in(tmp_path, 2)
        assert not list(Path(SHARED_MEMORY).iterdir())
        name.write_bytes(bytes(1 << 20))
        return refused(lambda: name.with_suffix(".more").write_bytes(bytes(4 << 20)))

    with beside(inside) as (pid, said):
        assert said == "No space left on device"
        assert not name.exists(), "nobody else sees it"
        assert shared_memory_mb(pid) == pytest.approx(2, abs=0.1)
    assert shared_memory_mb(pid) is None, "it has gone with its process"
    assert shared_memory_mb(os.getpid()) is None, "this process shares everybody's"
