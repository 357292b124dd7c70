"""One file over HTTP: resumed where it broke off, tried again, given up in time.

What has come so far lies beside the target as ``NAME.part`` and outlives a killed process. A server
that supports ranges goes on from there; another starts anew.
"""

import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import frozen

from matbench._version import __version__

if TYPE_CHECKING:
    from requests import Response, Session

CHUNK = 1 << 14
LONGEST_PAUSE = 30.0  # s


class TransferError(Exception):
    """A file that did not come, and why, in one line."""


class NoAnswer(TransferError):
    """The server could not be reached, stalled or broke off, each time it was tried."""


class _TryAgain(Exception):
    """What may pass, and how long the server asks to wait, in seconds."""

    def __init__(self, reason: str, pause: float = 0) -> None:
        super().__init__(reason)
        self.pause = pause


@frozen
class Patience:
    """How long to wait for a server.

    Parameters
    ----------
    timeout
        Seconds without a single byte after which a connection has stalled.
    retries
        How often in a row to try again while nothing more comes.
    pause
        Seconds before the first of them, doubled for each further one.
    """

    timeout: float = 30
    retries: int = 4
    pause: float = 1


PATIENCE = Patience()


def download(
    url: str,
    target: Path,
    limit: int,
    patience: Patience,
    listen: Callable[[int, int | None], None] = lambda *_: None,
) -> bool:
    """Bring a file to `target`, which is there whole afterwards or not at all.

    Parameters
    ----------
    url
        http or https; redirections are followed.
    target
        Where it goes; a file that is there already is left as it is.
    limit
        Most bytes to accept.
    listen
        Told (bytes so far, bytes in all if known) while it comes.

    Returns
    -------
    bool
        Did some of it, or all, come earlier, so that it may be of another file?

    Raises
    ------
    TransferError
        If the server refuses it or sends more than `limit`.
    NoAnswer
        If the server does not answer, or breaks off again and again; the part stays.
    OSError
        If it cannot be written, as on a full disk; the part stays.
    """
    import pooch

    pooch.get_logger().setLevel("WARNING")
    part = target.with_name(f"{target.name}.part")
    resumed = part.exists() or target.exists()

    def bring(url: str, output: str, _: object) -> None:
        try:
            _persist(url, part, limit, patience, listen)
        except NoAnswer:
            raise
        except TransferError:
            part.unlink(missing_ok=True)
            raise
        part.replace(output)

    pooch.retrieve(url, known_hash=None, fname=target.name, path=target.parent, downloader=bring)
    return resumed


@cache
def _session() -> "Session":
    """Connections that are kept for further files of a server."""
    import requests

    session = requests.Session()
    session.headers.update({"User-Agent": f"matbench/{__version__}", "Accept-Encoding": "identity"})
    return session


def _persist(
    url: str,
    part: Path,
    limit: int,
    patience: Patience,
    listen: Callable[[int, int | None], None],
) -> None:
    """Try until the part is whole."""
    from requests import exceptions

    failures, most = 0, _size(part)
    while True:
        try:
            _attempt(url, part, limit, patience, listen)
            return
        except (exceptions.InvalidURL, exceptions.InvalidSchema, exceptions.TooManyRedirects) as error:
            raise TransferError(f"it cannot be fetched: {error}") from error
        except (exceptions.RequestException, _TryAgain) as error:
            if _size(part) > most:  # it came further than ever: the server is alive
                failures, most = 0, _size(part)
            failures += 1
            if failures > patience.retries:
                raise NoAnswer(_reason(error)) from error
            asked = error.pause if isinstance(error, _TryAgain) else 0
            time.sleep(min(max(patience.pause * 2 ** (failures - 1), asked), LONGEST_PAUSE))


def _attempt(
    url: str,
    part: Path,
    limit: int,
    patience: Patience,
    listen: Callable[[int, int | None], None],
) -> None:
    """One request: the part is whole afterwards."""
    offset = _size(part)
    headers = {"Range": f"bytes={offset}-"} if offset else {}
    with _session().get(url, headers=headers, stream=True, timeout=patience.timeout) as response:
        if response.status_code == 416 and offset:
            if response.headers.get("Content-Range") == f"bytes */{offset}":
                return
            part.unlink()
            raise _TryAgain("the file has changed since its first part came")
        if response.status_code in (408, 425, 429) or response.status_code >= 500:
            pause = response.headers.get("Retry-After", "")
            raise _TryAgain(_status(response), float(pause) if pause.isdecimal() else 0)
        if response.status_code not in (200, 206):
            raise TransferError(_status(response))
        if response.status_code == 200:
            offset = 0
        elif not response.headers.get("Content-Range", "").startswith(f"bytes {offset}-"):
            part.unlink(missing_ok=True)
            raise _TryAgain("the server sent another part than the one asked for")
        length = response.headers.get("Content-Length", "")
        is_plain = "Content-Encoding" not in response.headers  # lengths are those of the file
        total = offset + int(length) if length.isdecimal() and is_plain else None
        if total is not None and total > limit:
            raise TransferError(f"{total} bytes are offered, at most {limit} can be right")
        with part.open("ab" if offset else "wb") as file:
            listen(offset, total)
            for chunk in response.iter_content(CHUNK):
                offset += len(chunk)
                if offset > limit:
                    raise TransferError(f"more than {limit} bytes came")
                file.write(chunk)
                listen(offset, total)
        if total is not None and offset != total:
            raise _TryAgain(f"it broke off after {offset} of {total} bytes")


def _status(response: "Response") -> str:
    return f"{response.status_code} {response.reason}"


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def _reason(error: Exception) -> str:
    """What went wrong with a connection, in words."""
    from requests import exceptions

    said = str(error)
    if isinstance(error, exceptions.Timeout) or "timed out" in said:
        return "the connection stalled"
    if isinstance(error, exceptions.SSLError):
        return "no secure connection: the server's certificate is not accepted"
    if "resolve" in said.lower():
        return "the server's name is not known: is there a network?"
    if "refused" in said.lower():
        return "the server refuses connections"
    if isinstance(error, exceptions.ChunkedEncodingError):
        return "it broke off"
    if isinstance(error, exceptions.ConnectionError):
        return "there is no connection to the server"
    return said.splitlines()[0] if said else type(error).__name__
