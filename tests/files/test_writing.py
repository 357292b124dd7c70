"""Files that are there whole or not at all."""

import os
import stat
from pathlib import Path

import pytest

from matbench.files.writing import write_bytes, write_text


def test_what_is_written_is_there_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_text(path, "ä,雪\n")
    assert path.read_bytes() == "ä,雪\n".encode()
    write_bytes(path, b"new")
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o644, "others may read it"
    assert list(tmp_path.iterdir()) == [path]


def test_what_fails_leaves_the_old_file_and_no_draft(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.csv"
    write_text(path, "old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_text(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_is_replaced_and_what_it_names_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("the key")
    (tmp_path / "a.csv").symlink_to(tmp_path / "secret")
    write_text(tmp_path / "a.csv", "mine")
    assert (tmp_path / "secret").read_text() == "the key"
    assert not (tmp_path / "a.csv").is_symlink()
