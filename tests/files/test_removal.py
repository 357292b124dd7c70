"""Whatever a method has made in a folder can be removed."""

import os
from pathlib import Path

import pytest

from matbench.files.removal import remove


def test_folders_deeper_than_a_path_is_long_are_removed(tmp_path: Path) -> None:
    top = tmp_path / "top"
    top.mkdir()
    place = os.open(top, os.O_RDONLY)
    for _ in range(3000):
        os.mkdir("a" * 20, dir_fd=place)
        os.close(os.open("file", os.O_CREAT | os.O_WRONLY, dir_fd=place))
        below = os.open("a" * 20, os.O_RDONLY, dir_fd=place)
        os.close(place)
        place = below
    os.close(place)
    remove(top)
    assert not os.path.lexists(top)


def test_links_are_removed_and_not_what_they_lead_to(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "file").touch()
    top = tmp_path / "top"
    (top / "in").mkdir(parents=True)
    (top / "in" / "link").symlink_to(tmp_path / "kept")
    (top / "link").symlink_to(tmp_path / "kept")
    os.mkfifo(top / "pipe")
    remove(top)
    (tmp_path / "alone").symlink_to(tmp_path / "kept")
    remove(tmp_path / "alone")
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
    assert (tmp_path / "kept" / "file").exists()


def test_many_files_and_folders_that_nobody_may_enter_are_removed(tmp_path: Path) -> None:
    top = tmp_path / "top"
    (top / "shut" / "in").mkdir(parents=True)
    for number in range(10000):
        (top / f"{number}").touch()
    (top / "shut" / "in" / "file").touch()
    (top / "shut").chmod(0)
    top.chmod(0o500)
    remove(top)
    assert not os.path.lexists(top)


def test_what_is_not_there_is_no_error_and_what_cannot_be_removed_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    remove(tmp_path / "none")
    (tmp_path / "top").mkdir()
    (tmp_path / "top" / "file").touch()

    def refuses(*_: object, **__: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "unlink", refuses)
    remove(tmp_path / "top")
    assert (tmp_path / "top" / "file").exists()
