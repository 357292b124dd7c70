"""A byte now and then is no reply: real servers that trickle, wherever they do it."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from matbench.files.pace import Pace
from matbench.files.transfer import NoAnswer, Patience, download

OK = b"HTTP/1.1 200 OK\r\n"


def endless(begin: bytes, again: bytes) -> Callable[[], Iterator[bytes]]:
    def pieces() -> Iterator[bytes]:
        yield begin
        while True:
            yield again

    return pieces


TRICKLES = {
    "the first line": endless(b"HTTP/1.1 200 ", b"O"),
    "one head line": endless(OK, b"X"),
    "head lines": endless(OK, b"X: y\r\n"),
    "replies before the reply": endless(b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
    "the length of a piece": endless(OK + b"Transfer-Encoding: chunked\r\n\r\n", b"0"),
    "what unpacks to nothing": endless(
        OK + b"Content-Encoding: gzip\r\nContent-Length: 100000\r\n\r\n\x1f\x8b\x08\x08\0\0\0\0\0\x03", b"x"
    ),
    "the file": endless(OK + b"Content-Length: 100000\r\n\r\n", b"x"),
    "a file of unknown length": endless(OK + b"\r\n", b"x"),
}


@pytest.fixture
def trickling() -> Iterator[Callable[[Callable[[], Iterator[bytes]]], str]]:
    listening = socket.socket()
    listening.bind(("127.0.0.1", 0))
    listening.listen()
    ended = threading.Event()

    def answer(to: socket.socket, pieces: Callable[[], Iterator[bytes]]) -> None:
        with to, suppress(OSError):
            to.recv(4096)
            for piece in pieces():
                to.sendall(piece)
                if ended.wait(0.03):
                    return

    def start(pieces: Callable[[], Iterator[bytes]]) -> str:
        def serve() -> None:
            with suppress(OSError):
                while True:
                    threading.Thread(target=answer, args=(listening.accept()[0], pieces), daemon=True).start()

        threading.Thread(target=serve, daemon=True).start()
        return f"http://127.0.0.1:{listening.getsockname()[1]}/a"

    yield start
    ended.set()
    listening.close()


@pytest.mark.parametrize("where", TRICKLES)
def test_a_trickle_is_given_up(
    trickling: Callable[[Callable[[], Iterator[bytes]]], str], tmp_path: Path, where: str
) -> None:
    url, failed = trickling(TRICKLES[where]), []

    def fetch() -> None:
        try:
            download(url, tmp_path / "a", 1 << 20, Patience(timeout=0.3, retries=1, pause=0.01))
        except NoAnswer as error:
            failed.append(str(error))

    fetching = threading.Thread(target=fetch, daemon=True)  # without a limit it would go on for ever
    fetching.start()
    fetching.join(10)
    assert failed == ["the connection stalled"]
    assert not (tmp_path / "a").exists()


def test_what_comes_in_time_starts_a_new_span() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs, Pace(seconds=0.4, least=10) as pace:
        pace.begin(ours)
        for count in (10, 20, 30, 40):
            time.sleep(0.2)
            pace.came(count)
        assert not pace.stalled
        for count in (41, 42, 43, 44):
            time.sleep(0.2)
            pace.came(count)
        assert pace.stalled
        assert ours.recv(1) == b""
