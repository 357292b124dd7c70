"""Processes that watch methods, as seen by the one that started them: are they still at work, and how do they end?

A method has the rights of whoever runs it, so it can stop or kill the process that watches it, and the fork server.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import psutil

from matbench.errors import UserError, cause
from matbench.files import temporary
from matbench.solving import processes, strays

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerProcess

_LOOK = 0.5  # seconds between two looks
_LOOKS = 4  # in a row that find it stopped: a scheduler may stop all for a while, and let this process go on first
_START = 120.0  # seconds that the fork server may take: it imports the harness first, perhaps from a slow disk
_TRIES = 3  # a method may kill the fork server at any moment
_PATIENCE = 5.0  # seconds that a watcher has to end its processes
_STOPPED = (psutil.STATUS_STOPPED, psutil.STATUS_TRACING_STOP)

_changing = threading.Lock()  # on a cluster, several threads start watchers
_living: dict[int, "Watcher"] = {}  # by process number


class Watcher:
    """A process that has others below it which run methods. It is forked from the server of `processes.start_server`.

    Raises
    ------
    UserError
        If it cannot be started.
    """

    def __init__(self, target: Callable[..., None], arguments: tuple[Any, ...]) -> None:
        self._process: ForkServerProcess = get_context("forkserver").Process(target=target, args=arguments)
        with _changing:
            self._start()
            assert self._process.pid is not None, "it has been started"  # noqa: S101
            # a number alone may by now be that of another process
            self._handle = psutil.Process(self._process.pid)
            _living[self._process.pid] = self
        self._found, self._next = 0, time.monotonic() + _LOOK

    def _start(self) -> None:
        for attempt in range(1, _TRIES + 1):
            try:
                with processes.no_daemon(), _server_in_time():
                    self._process.start()
            except (EOFError, OSError) as error:
                if attempt == _TRIES:
                    ended = "the process that they are forked from has ended"
                    said = ended if isinstance(error, ConnectionError | EOFError) else cause(error)
                    raise UserError(f"no process can be started for methods: {said}") from error
            else:
                return

    def is_stopped(self) -> bool:
        """Has it been stopped, so that it watches nothing any more? To be asked again and again."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + _LOOK
            with suppress(psutil.Error):
                self._found = self._found + 1 if self._handle.status() in _STOPPED else 0
        return self._found >= _LOOKS

    def end(self, at_once: bool = False) -> None:
        """Wait until it has ended, or kill it, if it does not end or `at_once`. Then end what it has left."""
        processes.wake_server()  # which is the one that notices
        if at_once:
            self._kill()
        self._process.join(_PATIENCE)
        if (code := self._process.exitcode) != 0:
            # where the server has ended, nobody tells its exit code: it may well be about to end
            psutil.wait_procs([self._handle], 0 if code is None else _PATIENCE)
            self._kill()
            self._process.join(_PATIENCE)
        with _changing:
            _living.pop(self._handle.pid, None)
            if code != 0:
                strays.end_left(set(_living))
                temporary.sweep()

    def _kill(self) -> None:
        with suppress(psutil.Error):
            self._handle.kill()


@contextmanager
def _server_in_time() -> Iterator[None]:
    """Have the fork server killed if it does not answer in time: whoever waits for it then gets an error."""
    processes.ensure_server()
    processes.wake_server()
    timer = threading.Timer(_START, processes.kill_server)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
