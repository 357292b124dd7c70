"""A connection that brings too little in its time is ended, whatever it is reading at that moment.

The time-out of a socket counts from one byte to the next. A server that sends a byte a second keeps it waiting for
ever, in the head of its reply above all, before any of the file has come.
"""

import socket
import threading
import time
from contextlib import suppress
from typing import Any

from requests.adapters import HTTPAdapter
from urllib3.connection import HTTPConnection, HTTPSConnection
from urllib3.connectionpool import HTTPConnectionPool, HTTPSConnectionPool

_here = threading.local()  # the pace that this thread's connections must keep


class Pace:
    """While it is entered, the connections of this thread must bring `least` bytes in each span of `seconds`.

    Attributes
    ----------
    stalled
        Was a connection ended?
    """

    def __init__(self, seconds: float, least: int) -> None:
        self.seconds, self.least, self.stalled = seconds, least, False
        self._socket: socket.socket | None = None
        self._counted = 0
        self._until = float("inf")
        self._done = threading.Event()
        self._watch = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "Pace":
        _here.pace = self
        self._watch.start()
        return self

    def __exit__(self, *_: object) -> None:
        _here.pace = None
        self._done.set()
        self._watch.join()

    def begin(self, connection: socket.socket | None) -> None:
        """The first span of a connection, or of one more reply on it, begins."""
        self._socket = connection
        self._until = time.monotonic() + self.seconds

    def came(self, count: int) -> None:
        """So many bytes of the file have come in all."""
        if count - self._counted >= self.least:
            self._counted = count
            self._until = time.monotonic() + self.seconds

    def _run(self) -> None:
        while not self._done.wait(min(self.seconds / 8, 1)):
            if time.monotonic() > self._until and self._socket is not None:
                self.stalled = True
                with suppress(OSError):  # it has ended by itself
                    socket.socket.shutdown(self._socket, socket.SHUT_RDWR)
                return


class _Paced:
    """A connection that tells the thread's pace of its socket."""

    def _new_conn(self) -> socket.socket:
        made: socket.socket = super()._new_conn()  # type: ignore[misc]  # of the class beside it
        _tell(made)
        return made

    def getresponse(self) -> Any:
        _tell(self.sock)  # type: ignore[attr-defined]
        return super().getresponse()  # type: ignore[misc]


def _tell(connection: socket.socket | None) -> None:
    pace = getattr(_here, "pace", None)
    if pace is not None:
        pace.begin(connection)


class _Plain(_Paced, HTTPConnection):
    pass


class _Secure(_Paced, HTTPSConnection):
    pass


class _PlainPool(HTTPConnectionPool):
    ConnectionCls = _Plain


class _SecurePool(HTTPSConnectionPool):
    ConnectionCls = _Secure


class PacedAdapter(HTTPAdapter):
    """What makes the connections of a `requests.Session` keep a pace."""

    def init_poolmanager(self, *args: Any, **kwargs: Any) -> None:
        super().init_poolmanager(*args, **kwargs)
        self.poolmanager.pool_classes_by_scheme = _POOLS

    def proxy_manager_for(self, *args: Any, **kwargs: Any) -> Any:
        manager = super().proxy_manager_for(*args, **kwargs)
        manager.pool_classes_by_scheme = _POOLS
        return manager


_POOLS = {"http": _PlainPool, "https": _SecurePool}
