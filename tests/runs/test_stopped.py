"""What is at fault where a run cannot go on."""

import errno
import os
from pathlib import Path

import pytest

from matbench.runs.stopped import FolderLost, Stopped


def refused(number: int, path: Path | None = None) -> OSError:
    return OSError(number, os.strerror(number), *([] if path is None else [str(path)]))


def test_the_run_folder_is_blamed_only_for_what_lies_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = tmp_path / "run"
    inside = Stopped.of(run, refused(errno.EACCES, run / "cells" / "x"))
    assert isinstance(inside, FolderLost)
    assert str(inside).startswith(f"run folder {str(run)!r} cannot be used: Permission denied")
    monkeypatch.chdir(tmp_path)
    assert isinstance(Stopped.of(Path("run"), refused(errno.EACCES, run / "cells")), FolderLost)
    elsewhere = Stopped.of(run, refused(errno.EACCES, tmp_path / "scene.png"))
    assert not isinstance(elsewhere, FolderLost)
    assert str(elsewhere).startswith(f"{str(tmp_path / 'scene.png')!r} cannot be used: Permission denied")


def test_what_is_of_no_file_is_the_folder_s_only_if_it_is_about_storing(tmp_path: Path) -> None:
    assert isinstance(Stopped.of(tmp_path, refused(errno.ENOSPC)), FolderLost)
    assert isinstance(Stopped.of(tmp_path, refused(errno.ESTALE)), FolderLost)
    many = Stopped.of(tmp_path, refused(errno.EMFILE))
    assert not isinstance(many, FolderLost)
    assert "Too many open files: raise their number with ulimit -n" in str(many)
    assert "run folder" not in str(many)
    assert "AF_UNIX path too long" in str(Stopped.of(tmp_path, OSError("AF_UNIX path too long")))
