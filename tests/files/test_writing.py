"""Files that are there whole or not at all."""

import errno
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from refusing import refusing

from matbench.files.writing import draft_folder, drafted, settle, write_bytes, write_text


def test_what_is_written_is_there_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_text(path, "ä,雪\n")
    assert path.read_bytes() == "ä,雪\n".encode()
    write_bytes(path, b"new")
    assert path.read_bytes() == b"new"
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


def test_what_need_not_be_on_the_disk_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[int] = []
    monkeypatch.setattr(os, "fsync", waited.append)
    for settled, count in ((False, 0), (True, 1)):
        with drafted(tmp_path / "a", settled=settled) as file:
            file.write(b"content")
        assert len(waited) == count
        assert (tmp_path / "a").read_bytes() == b"content"


def test_a_link_is_replaced_and_what_it_names_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("the key")
    (tmp_path / "a.csv").symlink_to(tmp_path / "secret")
    write_text(tmp_path / "a.csv", "mine")
    assert (tmp_path / "secret").read_text() == "the key"
    assert not (tmp_path / "a.csv").is_symlink()


@pytest.mark.parametrize(
    ("umask", "file", "folder"), [(0o022, 0o644, 0o755), (0o002, 0o664, 0o775), (0o077, 0o600, 0o700)]
)
def test_who_may_read_it_is_said_by_the_umask_and_the_folder_above(
    umask: int, file: int, folder: int, tmp_path: Path
) -> None:
    tmp_path.chmod(0o2775)  # what is made there is of its group
    before = os.umask(umask)
    try:
        write_text(tmp_path / "a.csv", "a")
        made = draft_folder(tmp_path, "cell")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.csv").stat().st_mode) == file
    assert stat.S_IMODE(made.stat().st_mode) == 0o2000 | folder


def test_an_error_names_the_file_that_was_to_be_written(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as error:
        write_text(tmp_path / "missing" / "a.csv", "a")
    assert error.value.filename == str(tmp_path / "missing" / "a.csv")


WRITE = """
import sys
from pathlib import Path
from matbench.files.writing import settle, write_text
place = Path(sys.argv[1])
write_text(place / "a.csv", "old")
write_text(place / "a.csv", "new")
print(settle(place), settle(place / "a.csv"))
"""


@pytest.mark.parametrize("number", [errno.EPERM, errno.EINVAL, errno.ENOTSUP])
def test_a_file_system_that_refuses_calls_is_written_all_the_same(number: int, tmp_path: Path) -> None:
    place = tmp_path / "place"
    place.mkdir()
    calls = dict.fromkeys(("chmod", "fsync", "fsync_folder", "link", "rename_over"), number)
    environment = refusing(tmp_path, place, calls)
    line = [sys.executable, "-c", WRITE, str(place)]
    told = subprocess.run(line, env=environment, capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["False", "False"]
    assert {path.name: path.read_text() for path in place.iterdir()} == {"a.csv": "new"}
    assert settle(place), "here it can be told"


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC])
def test_what_is_not_on_the_disk_is_not_taken_for_a_call_that_is_not_offered(number: int, tmp_path: Path) -> None:
    place = tmp_path / "place"
    place.mkdir()
    environment = refusing(tmp_path, place, {"fsync": number})
    told = subprocess.run([sys.executable, "-c", WRITE, str(place)], env=environment, capture_output=True, text=True)
    assert told.returncode
    assert os.strerror(number) in told.stderr
    assert list(place.iterdir()) == []
