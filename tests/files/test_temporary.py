"""Temporary folders end with their process, be it by the next one."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from matbench.files.temporary import sweep, temporary_folder

HOLDS = """
import sys
from matbench.files.temporary import temporary_folder
with temporary_folder() as place:
    (place / "file").touch()
    print(place, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return tmp_path


def test_a_folder_goes_with_its_block(place: Path) -> None:
    with temporary_folder() as folder:
        assert folder.parent == place
        assert folder.stat().st_mode & 0o777 == 0o700
        (folder / "in").mkdir()
    assert not list(place.iterdir())


def test_those_of_killed_processes_are_swept_and_no_others(place: Path) -> None:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    held: list[Path] = []
    with subprocess.Popen([sys.executable, "-c", HOLDS], text=True, **pipes) as killed:
        held.append(Path(killed.stdout.readline().strip()))
        with subprocess.Popen([sys.executable, "-c", HOLDS], text=True, **pipes) as lives:
            held.append(Path(lives.stdout.readline().strip()))
            for name in ("matbench-mine", "matbench-new-12345678", "held"):
                (place / name).mkdir()
            (place / "matbench-held-link").symlink_to(held[1])
            (place / "matbench-held-file").touch()
            killed.kill()
            killed.wait()
            with temporary_folder() as own:
                sweep()
                assert own.exists()
            assert [path.exists() for path in held] == [False, True]
            assert {path.name for path in place.iterdir()} == {
                held[1].name,
                "matbench-mine",
                "matbench-new-12345678",
                "held",
                "matbench-held-link",
                "matbench-held-file",
            }
            lives.stdin.close()
            lives.wait()
    assert not held[1].exists()


def test_what_has_been_put_in_the_place_of_one_is_swept(place: Path) -> None:
    """A method can do that: the process that was to remove its folder may have been killed since."""
    (place / "folder").mkdir()
    (place / "folder" / "file").touch()
    os.mkfifo(place / "matbench-held-0123abcd")
    (place / "matbench-held-0123abce").symlink_to(place / "folder")
    (place / "matbench-held-0123abcf").touch()
    sweep()
    assert {str(path.relative_to(place)) for path in place.rglob("*")} == {"folder", "folder/file"}


def test_where_nothing_can_be_locked_nothing_is_swept(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*_: object) -> None:
        raise OSError(95, "not offered")

    monkeypatch.setattr("matbench.files.temporary.flock", refuses)
    with temporary_folder() as folder:
        (place / "matbench-held-12345678").mkdir()
        sweep()
        assert folder.exists()
    assert [path.name for path in place.iterdir()] == ["matbench-held-12345678"]


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give a folder to somebody else")
def test_those_of_others_are_left(place: Path) -> None:
    (place / "matbench-held-12345678").mkdir()
    os.chown(place / "matbench-held-12345678", 12345, 12345)
    sweep()
    assert list(place.iterdir())
