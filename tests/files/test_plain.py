"""Only plain files are opened, and no more of them is read than was said."""

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

from matbench.files.plain import NotPlain, digest_content, digest_plain, open_plain, read_plain


def pipe(path: Path) -> None:
    os.mkfifo(path)


def link_to_a_pipe(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    path.symlink_to("pipe")


def endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def circle(path: Path) -> None:
    path.symlink_to(path.name)


def folder(path: Path) -> None:
    path.mkdir()


def listening(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as one:
        place = Path.cwd()
        os.chdir(path.parent)  # the name of a socket must be short
        try:
            one.bind(path.name)
        finally:
            os.chdir(place)


@pytest.mark.parametrize("make", [pipe, link_to_a_pipe, endless, circle, folder, listening])
@pytest.mark.parametrize("read", [open_plain, lambda path: read_plain(path, most=9), digest_plain])
def test_what_is_no_plain_file_is_refused_at_once(
    make: Callable[[Path], None], read: Callable[[Path], object], tmp_path: Path
) -> None:
    make(tmp_path / "one")
    with pytest.raises(NotPlain, match=r"^one is a (pipe|device|folder|socket|link that leads to itself) and no file$"):
        read(tmp_path / "one")


def test_a_link_is_followed_only_where_the_caller_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"12345")
    (tmp_path / "link").symlink_to("file")
    assert read_plain(tmp_path / "link", most=5) == b"12345"
    for read in (open_plain, digest_plain, lambda path, **said: read_plain(path, most=5, **said)):
        with pytest.raises(NotPlain, match="link is a link and no file"):
            read(tmp_path / "link", follow=False)
    assert read_plain(tmp_path / "file", most=5, follow=False) == b"12345"


def test_what_is_larger_than_was_said_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "sparse").open("wb") as file:
        file.truncate(1 << 40)
    for read in (open_plain, read_plain, digest_plain):
        with pytest.raises(NotPlain, match="sparse has 1099511627776 bytes: 1048576 are possible"):
            read(tmp_path / "sparse", most=1 << 20)
    with open_plain(tmp_path / "sparse") as file:
        assert file.read(3) == b"\0\0\0"


def test_a_file_that_claims_to_be_empty_is_read_no_further_than_was_said() -> None:
    maps = Path("/proc/self/maps")
    if not maps.exists():
        pytest.skip("no file of the system claims to be empty here")
    assert maps.stat().st_size == 0
    for read in (read_plain, digest_plain):
        with pytest.raises(NotPlain, match="maps has more than 100 bytes"):
            read(maps, most=100)


def test_the_digest_is_that_of_the_content(tmp_path: Path) -> None:
    content = bytes(range(256)) * 5000
    (tmp_path / "file").write_bytes(content)
    assert digest_plain(tmp_path / "file") == sha256(content).hexdigest()


def test_a_missing_file_is_the_usual_error(tmp_path: Path) -> None:
    for read in (open_plain, digest_plain, lambda path: read_plain(path, most=5)):
        with pytest.raises(FileNotFoundError):
            read(tmp_path / "none")


def test_nothing_stays_open(tmp_path: Path) -> None:
    """In a process of its own, whose open files nobody else changes."""
    code = """
import os, sys
from pathlib import Path
from matbench.files.plain import open_plain, NotPlain
place = Path(sys.argv[1])
before = len(os.listdir("/proc/self/fd"))
real, calls = os.fstat, []
def replaced(number):
    calls.append(number)
    return os.stat(place)  # it became a folder in between
os.fstat = replaced
try:
    open_plain(place / "file")
except NotPlain:
    calls.append("refused")
os.fstat = real
print(len(os.listdir("/proc/self/fd")) - before, calls[-1])
"""
    if not Path("/proc/self/fd").is_dir():
        pytest.skip("open files cannot be counted here")
    (tmp_path / "file").write_bytes(b"1")
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, timeout=300)
    assert done.stdout.split() == ["0", "refused"], done.stderr


def test_a_folder_counts_with_its_names(tmp_path: Path) -> None:
    (tmp_path / "w").mkdir()
    (tmp_path / "w" / "a").write_bytes(b"1")
    before = digest_content(tmp_path / "w")
    (tmp_path / "w" / "a").rename(tmp_path / "w" / "b")
    renamed = digest_content(tmp_path / "w")
    (tmp_path / "w" / "b").write_bytes(b"2")
    assert len({before, renamed, digest_content(tmp_path / "w")}) == 3


def test_what_never_ends_has_no_digest(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("/dev/zero")
    with pytest.raises(NotPlain, match="a device"):
        digest_content(tmp_path / "link")
    nothing = digest_content(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    assert digest_content(tmp_path) == nothing, "in a folder, only plain files count"
