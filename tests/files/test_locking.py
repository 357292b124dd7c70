"""Locks on files and folders."""

import errno
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer

import pytest
from refusing import refusing

from matbench.files.locking import Busy, held, is_held

HOLD = """
import sys
from pathlib import Path
from matbench.files.locking import Busy, held
try:
    with held(*map(Path, sys.argv[1:])) as taken:
        print(*sorted(place.name for place in taken), flush=True)
        sys.stdin.read()
except Busy:
    print("busy", flush=True)
"""


@contextmanager
def holder(*places: Path, env: dict[str, str] | None = None) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """A process that holds locks until it is killed, and what it says."""
    line = [sys.executable, "-c", HOLD, *map(str, places)]
    process = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=env)
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.communicate()


def test_one_process_holds_it_until_it_ends_however_it_ends(tmp_path: Path) -> None:
    assert not is_held(tmp_path)
    with holder(tmp_path, tmp_path / "a.lock") as (process, said):
        assert said.split() == sorted(["a.lock", tmp_path.name])
        assert is_held(tmp_path)
        assert is_held(tmp_path / "a.lock")
        with pytest.raises(Busy), held(tmp_path):
            pass
        with pytest.raises(Busy), held(tmp_path / "a.lock"):
            pass
        (tmp_path / "a.lock").unlink()
        with pytest.raises(Busy), held(tmp_path, tmp_path / "a.lock"):
            pass  # a new file could be locked, but the folder cannot
        Timer(0.2, process.kill).start()
        with held(tmp_path, patience=60) as taken:
            assert taken == {tmp_path}
    assert not is_held(tmp_path)


def test_two_who_ask_do_not_take_each_other_for_a_holder(tmp_path: Path) -> None:
    import fcntl

    number = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(number, fcntl.LOCK_SH)  # as `is_held` does for a moment
    assert not is_held(tmp_path)
    os.close(number)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOTSUP, errno.EPERM, errno.EINVAL, errno.EBADF])
def test_where_nothing_can_be_locked_it_is_told(number: int, tmp_path: Path) -> None:
    place = tmp_path / "place"
    place.mkdir()
    with holder(place, place / "a.lock", env=refusing(tmp_path, place, {"flock": number})) as (_, said):
        assert said == ""
    assert is_held(place) is False
    assert is_held(place / "missing") is None


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "a.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OSError, match="symbolic links"), held(tmp_path / "a.lock"):
        pass
    assert not (tmp_path / "elsewhere").exists()
