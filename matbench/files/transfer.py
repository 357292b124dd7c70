"""One file over HTTP: resumed where it broke off, tried again, given up in time.

What has come so far lies beside the target as ``NAME.part``; it is kept when the process is killed.
The next try asks the server for the rest. From a server that sends no parts of files, the whole file
comes again.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import frozen

from matbench._version import __version__
from matbench.files.writing import move

if TYPE_CHECKING:
    from requests import Response, Session
    from urllib3 import Retry

    from matbench.files.pace import Pace

CHUNK = 1 << 14
LONGEST_PAUSE = 30.0  # s
LEAST = 1 << 10
"""Bytes that must come within `Patience.timeout`, and that an attempt must add to count as progress."""


class TransferError(Exception):
    """A file that did not come, and why, in one line."""


class NoAnswer(TransferError):
    """The server could not be reached, stalled or broke off, each time it was tried."""


@frozen
class Patience:
    """How long to wait for a server.

    Parameters
    ----------
    timeout
        Seconds within which a connection must bring `LEAST` bytes; else it has stalled.
    retries
        How often in a row to try again while nothing more comes.
    pause
        Seconds to wait before the first of these, doubled before each further one. A server that asks
        for a longer pause (``Retry-After``) gets it. No pause is longer than `LONGEST_PAUSE`.
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
        Did some of it, or all, come earlier? The site may have changed the file since, so that the two
        parts are of different files: check the content.

    Raises
    ------
    TransferError
        If the server refuses it or sends more than `limit`.
    NoAnswer
        If the server does not answer, or breaks off again and again; the part stays.
    OSError
        If it cannot be written, as on a full disk; the part stays.
    """
    if target.exists():
        return True
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f"{target.name}.part")
    resumed = part.exists()
    try:
        _persist(url, part, limit, patience, listen)
    except NoAnswer:
        raise
    except TransferError:
        part.unlink(missing_ok=True)
        raise
    move(part, target)
    return resumed


@cache
def _session() -> "Session":
    """Connections that stay open for further files from the same server."""
    import requests

    from matbench.files.pace import PacedAdapter

    session = requests.Session()
    for kind in ("http://", "https://"):
        session.mount(kind, PacedAdapter())
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
    from urllib3.exceptions import HTTPError, MaxRetryError

    fresh = _retries(patience)
    left, most = fresh, _size(part)
    while True:
        try:
            _attempt(url, part, limit, patience, listen)
            return
        except (exceptions.InvalidSchema, exceptions.TooManyRedirects, ValueError) as error:
            # of a server that sends elsewhere, the address may be anything: no `InvalidURL` for some
            raise TransferError(f"it cannot be fetched: {error}") from error
        except (exceptions.RequestException, HTTPError) as error:
            if _size(part) >= most + LEAST:  # it came further than ever: the server is alive
                left, most = fresh, _size(part)
            try:
                left = left.increment()
            except MaxRetryError:
                raise NoAnswer(_reason(error)) from error
            time.sleep(min(max(left.get_backoff_time(), _asked(left, error)), LONGEST_PAUSE))


def _retries(patience: Patience) -> "Retry":
    """How often to try again, and the pauses in between.

    requests could count by itself (`HTTPAdapter`), but only until a reply begins: not when a body
    breaks off, the usual case here.
    """
    from urllib3.util.retry import RequestHistory, Retry

    # urllib3 waits from the second failure on; with one in the history it waits after the first, too
    before = (RequestHistory("GET", None, None, None, None),)
    return Retry(patience.retries, backoff_factor=patience.pause / 2, backoff_max=LONGEST_PAUSE, history=before)


def _asked(left: "Retry", error: Exception) -> float:
    """Seconds that the server asks to wait by ``Retry-After``; 0 if it does not, or not in a known form."""
    from urllib3.exceptions import InvalidHeader

    response = getattr(error, "response", None)
    with suppress(InvalidHeader):
        return 0 if response is None else left.get_retry_after(response.raw) or 0
    return 0


def _attempt(
    url: str,
    part: Path,
    limit: int,
    patience: Patience,
    listen: Callable[[int, int | None], None],
) -> None:
    """One request: the part is whole afterwards."""
    from requests.exceptions import RequestException
    from urllib3.exceptions import HTTPError

    from matbench.files.pace import Pace

    pace = Pace(patience.timeout, LEAST)
    try:
        with pace:
            _request(url, part, limit, pace, listen)
    except (RequestException, HTTPError) as error:
        if pace.stalled:
            raise RequestException("the connection stalled") from error
        raise


def _request(
    url: str,
    part: Path,
    limit: int,
    pace: "Pace",
    listen: Callable[[int, int | None], None],
) -> None:
    from requests.exceptions import RequestException

    offset = _size(part)
    headers = {"Range": f"bytes={offset}-"} if offset else {}
    with _session().get(url, headers=headers, stream=True, timeout=pace.seconds) as response:
        if response.status_code == 416 and offset:
            if response.headers.get("Content-Range") == f"bytes */{offset}":
                return
            part.unlink()
            raise RequestException("the file has changed since its first part came")
        if response.status_code in (408, 425, 429) or response.status_code >= 500:
            raise RequestException(_status(response), response=response)
        if response.status_code not in (200, 206):
            raise TransferError(_status(response))
        if response.status_code == 200:
            offset = 0
        elif not response.headers.get("Content-Range", "").startswith(f"bytes {offset}-"):
            part.unlink(missing_ok=True)
            raise RequestException("the server sent another part than the one asked for")
        length = response.headers.get("Content-Length", "")
        is_plain = "Content-Encoding" not in response.headers  # lengths are those of the file
        total = offset + int(length) if length.isdecimal() and is_plain else None
        if total is not None and total > limit:
            raise TransferError(f"{total} bytes are offered, at most {limit} can be right")
        first = offset
        with part.open("ab" if offset else "wb") as file:
            listen(offset, total)
            # not `iter_content`: it waits for a whole chunk, however slowly that comes
            while chunk := response.raw.read1(CHUNK, decode_content=True):
                offset += len(chunk)
                if offset > limit:
                    raise TransferError(f"more than {limit} bytes came")
                file.write(chunk)
                listen(offset, total)
                pace.came(offset - first)
            if pace.stalled:  # without a length, the end of a connection is the end of the file
                raise RequestException("the connection stalled")


def _status(response: "Response") -> str:
    return f"{response.status_code} {response.reason}"


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def _reason(error: Exception) -> str:
    """What went wrong with a connection, in words."""
    from requests import exceptions
    from urllib3.exceptions import ProtocolError

    said = str(error)
    if type(error) is exceptions.RequestException:  # our own words
        return said
    if isinstance(error, exceptions.Timeout) or "timed out" in said:
        return "the connection stalled"
    if isinstance(error, exceptions.SSLError):
        return "no secure connection: the server's certificate is not accepted"
    if "resolve" in said.lower():
        return "the server's name is not known: is there a network?"
    if "refused" in said.lower():
        return "the server refuses connections"
    if isinstance(error, ProtocolError):
        return "it broke off"
    if isinstance(error, exceptions.ConnectionError):
        return "there is no connection to the server"
    return said.splitlines()[0] if said else type(error).__name__
