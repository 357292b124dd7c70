"""Downloads over a real connection, with everything that can happen to one."""

import os
import resource
import socket
import subprocess
import sys
import time
from email.utils import formatdate
from pathlib import Path

import pytest

from matbench.files import transfer
from matbench.files.transfer import NoAnswer, Patience, TransferError, download

BODY = os.urandom(200_000)
QUICK = Patience(timeout=20, retries=3, pause=0.01)
SHORT = Patience(timeout=0.4, retries=3, pause=0.01)
LIMIT = 1 << 20


def fetch(site, target: Path, patience: Patience = QUICK, limit: int = LIMIT) -> bool:
    site.files.setdefault("a.zip", BODY)
    return download(f"{site.url}a.zip", target, limit, patience)


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return tmp_path / "stage" / "a.zip"


def part_of(target: Path, content: bytes) -> Path:
    target.parent.mkdir(exist_ok=True)
    part = target.with_name("a.zip.part")
    part.write_bytes(content)
    return part


def test_a_file_comes_whole_and_nothing_else_stays(site, target: Path) -> None:
    heard = []
    site.files["a.zip"] = BODY
    assert download(f"{site.url}a.zip", target, LIMIT, QUICK, lambda *said: heard.append(said)) is False
    assert target.read_bytes() == BODY
    assert [path.name for path in target.parent.iterdir()] == ["a.zip"]
    assert heard[0] == (0, len(BODY))
    assert heard[-1] == (len(BODY), len(BODY))
    assert [count for count, _ in heard] == sorted(count for count, _ in heard)
    assert site.sent("a.zip") == [(None, len(BODY))]


def test_a_part_that_came_earlier_is_gone_on_with(site, target: Path) -> None:
    part_of(target, BODY[:150_000])
    assert fetch(site, target) is True
    assert target.read_bytes() == BODY
    assert site.sent("a.zip") == [("bytes=150000-", 50_000)]


def test_a_server_without_ranges_sends_it_all_again(site, target: Path) -> None:
    part_of(target, BODY[:150_000])
    site.ranges = False
    fetch(site, target)
    assert target.read_bytes() == BODY


def test_a_body_cut_short_is_noticed_and_gone_on_with(site, target: Path) -> None:
    site.faults["a.zip"] = [("cut", 100_000), ("cut", 50_000)]
    fetch(site, target)
    assert target.read_bytes() == BODY
    starts = [int(asked.removeprefix("bytes=").rstrip("-")) for asked, _ in site.sent("a.zip") if asked]
    assert len(starts) == 2
    assert 0 < starts[0] <= 100_000 < starts[1] <= 150_000


def test_a_body_without_a_length_that_is_cut_is_taken_as_it_is(site, target: Path) -> None:
    """HTTP cannot tell; the digest of the file does."""
    site.faults["a.zip"] = [("headers", {"Content-Length": None})]
    fetch(site, target)
    assert target.read_bytes() == BODY


def test_a_server_that_always_breaks_off_is_given_up_and_the_part_stays(site, target: Path) -> None:
    site.ranges = False
    site.faults["a.zip"] = [("cut", 100_000)]
    site.forever.add("a.zip")
    with pytest.raises(NoAnswer, match="broke off"):
        fetch(site, target)
    assert not target.exists()
    part = target.with_name("a.zip.part").read_bytes()
    assert part == BODY[: len(part)]
    assert 50_000 < len(part) <= 100_000
    # the first attempt came further than nothing: the count of those in vain starts after it
    assert len(site.requests) == 1 + QUICK.retries


@pytest.mark.parametrize("sent", [0, 60_000])
def test_a_stalled_connection_is_left_and_tried_again(site, target: Path, sent: int) -> None:
    site.faults["a.zip"] = [("stall", sent)]
    start = time.monotonic()
    fetch(site, target, SHORT)
    assert target.read_bytes() == BODY
    assert 0.4 <= time.monotonic() - start < 60


def test_a_connection_that_stalls_for_ever_ends_in_words(site, target: Path) -> None:
    site.faults["a.zip"] = [("stall", 0)]
    site.forever.add("a.zip")
    start = time.monotonic()
    with pytest.raises(NoAnswer, match="stalled"):
        fetch(site, target, SHORT)
    assert time.monotonic() - start < 60
    assert len(site.requests) == 1 + QUICK.retries


def test_a_trickle_is_given_up_as_if_nothing_came(site, target: Path) -> None:
    site.faults["a.zip"] = [("slow", 0, 0.05, 1)]
    site.forever.add("a.zip")
    start = time.monotonic()
    with pytest.raises(NoAnswer, match="stalled"):
        fetch(site, target, SHORT)
    assert time.monotonic() - start < 60
    assert len(site.requests) == 1 + SHORT.retries
    part = target.with_name("a.zip.part").read_bytes()
    assert part == BODY[: len(part)]
    assert 0 < len(part) < transfer.LEAST


@pytest.mark.parametrize("status", [404, 403, 410])
def test_what_a_server_refuses_is_not_asked_for_again(site, target: Path, status: int) -> None:
    site.faults["a.zip"] = [status]
    part_of(target, b"old")
    with pytest.raises(TransferError, match=str(status)) as caught:
        fetch(site, target)
    assert not isinstance(caught.value, NoAnswer)
    assert len(site.requests) == 1
    assert list(target.parent.iterdir()) == []


def test_a_busy_server_is_asked_again_later(site, target: Path) -> None:
    site.faults["a.zip"] = [503, 429, 500]
    fetch(site, target)
    assert target.read_bytes() == BODY
    assert len(site.requests) == 4


def test_a_server_gets_the_pause_that_it_asks_for(site, target: Path) -> None:
    site.faults["a.zip"] = [("busy", "1")]
    start = time.monotonic()
    fetch(site, target)
    assert 1 <= time.monotonic() - start < 60


def test_the_pause_may_be_asked_for_by_a_date(site, target: Path) -> None:
    date = int(time.time()) + 2  # dates have whole seconds
    site.faults["a.zip"] = [("busy", formatdate(date, usegmt=True))]
    fetch(site, target)
    assert date - 0.1 <= time.time() < date + 60


def test_no_pause_is_longer_than_the_longest(site, target: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transfer, "LONGEST_PAUSE", 0.1)
    site.faults["a.zip"] = [("busy", "3600")]
    start = time.monotonic()
    fetch(site, target)
    assert time.monotonic() - start < 60


@pytest.mark.parametrize("asked", ["soon", "-1", ""])
def test_a_pause_that_is_none_is_passed_over(site, target: Path, asked: str) -> None:
    site.faults["a.zip"] = [("busy", asked)]
    fetch(site, target)
    assert target.read_bytes() == BODY


def test_pauses_grow(site, target: Path) -> None:
    site.faults["a.zip"] = [503]
    site.forever.add("a.zip")
    start = time.monotonic()
    with pytest.raises(NoAnswer, match="503"):
        fetch(site, target, Patience(20, 3, 0.1))
    assert time.monotonic() - start >= 0.1 + 0.2 + 0.4


def test_a_part_that_is_whole_already_is_taken(site, target: Path) -> None:
    part_of(target, BODY)
    fetch(site, target)
    assert target.read_bytes() == BODY
    assert site.sent("a.zip") == [(f"bytes={len(BODY)}-", 0)]


def test_a_part_longer_than_the_file_is_dropped(site, target: Path) -> None:
    part_of(target, BODY + b"more")
    fetch(site, target)
    assert target.read_bytes() == BODY


def test_another_range_than_the_one_asked_for_is_not_appended(site, target: Path) -> None:
    part_of(target, BODY[:1000])
    site.faults["a.zip"] = [("headers", {"Content-Range": "bytes 0-10/200000"})]
    fetch(site, target)
    assert target.read_bytes() == BODY


def test_no_more_than_the_limit_is_taken(site, target: Path) -> None:
    with pytest.raises(TransferError, match="200000 bytes are offered"):
        fetch(site, target, limit=199_999)
    site.faults["a.zip"] = [("headers", {"Content-Length": None})]
    with pytest.raises(TransferError, match="more than 100000"):
        fetch(site, target, limit=100_000)
    assert list(target.parent.iterdir()) == []
    fetch(site, target, limit=200_000)
    assert target.read_bytes() == BODY


def test_nobody_there(target: Path, tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    with pytest.raises(NoAnswer, match="refuses"):
        download(f"http://127.0.0.1:{port}/a.zip", target, LIMIT, QUICK)
    with pytest.raises(NoAnswer, match="not known"):
        download("http://no-such-server.invalid/a.zip", target, LIMIT, QUICK)


def test_a_redirection_is_followed(site, target: Path) -> None:
    site.files["a.zip"] = BODY
    site.moved["old.zip"] = "/a.zip"
    download(f"{site.url}old.zip", target, LIMIT, QUICK)
    assert target.read_bytes() == BODY


@pytest.mark.parametrize("place", ["http://[", "http://host:port/", f"http://{'x' * 64}.org/", "ftp://host/a.zip"])
def test_a_redirection_to_what_is_no_address_is_refused_at_once(site, place: str, target: Path) -> None:
    site.moved["old.zip"] = place
    with pytest.raises(TransferError, match="it cannot be fetched"):
        download(f"{site.url}old.zip", target, LIMIT, QUICK)
    assert len(site.requests) == 1
    assert not list(target.parent.iterdir())


FULL = """
import sys
from pathlib import Path
from matbench.files.transfer import Patience, download
try:
    download(sys.argv[1], Path(sys.argv[2]), 1 << 20, Patience(5, 2, 0.01))
except OSError as error:
    print(error.errno)
"""


def test_a_file_that_cannot_be_written_is_an_os_error_not_a_network_error(site, target: Path) -> None:
    """In a process that may write 64 KiB a file: the write fails as on a full disk."""
    site.files["a.zip"] = BODY
    target.parent.mkdir()
    line = [sys.executable, "-c", FULL, f"{site.url}a.zip", str(target)]
    done = subprocess.run(
        line,
        capture_output=True,
        text=True,
        timeout=300,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 16, 1 << 16)),
    )
    assert done.stdout.strip() == "27", done.stderr  # EFBIG
    assert [path.name for path in target.parent.iterdir()] == ["a.zip.part"]
    assert len(site.requests) == 1
    fetch(site, target)
    assert target.read_bytes() == BODY
    assert site.requests[-1][1] == "bytes=65536-"
