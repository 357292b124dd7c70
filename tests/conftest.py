"""Fixtures for tests of all parts."""

import os
import signal
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from machines import Machines
from tools import need

from matbench.plans.plugins import kernel_cache
from matbench.solving import check_scenes

if TYPE_CHECKING:
    from following import Desk
    from real import Real

    from matbench.reports.content import Report

# numba does not notice changes of what a kernel calls in another file: each state of the code has its own cache
os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))
# tests neither find nor touch the scenes of whoever runs them
_own = tempfile.TemporaryDirectory(prefix="matbench-tests-")
os.environ["XDG_DATA_HOME"] = _own.name
# each scene is computed by the code that is tested
os.environ["MATBENCH_CACHE_MB"] = "0"
# tests press Ctrl-C: a shell that starts them in the background would have their processes ignore it
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Count what was skipped, by reason: a tool or a scene that is missing shall not go unnoticed."""
    skipped = [report.longrepr for report in terminalreporter.stats.get("skipped", [])]
    said = [str(one[2] if isinstance(one, tuple | list) else one) for one in skipped]
    reasons = Counter(one.removeprefix("Skipped: ") for one in said)
    if reasons:
        terminalreporter.section(f"{reasons.total()} skipped, by reason")
        for reason, count in reasons.most_common():
            terminalreporter.line(f"{count:4}  {reason}")


@pytest.fixture(scope="session")
def data_root() -> Path:
    """The folder of real scenes; without one, tests on real scenes skip and say so."""
    named = os.environ.get("MATBENCH_DATA")
    if not named:
        pytest.skip("MATBENCH_DATA is not set: no real scenes")
    root = Path(named).expanduser()
    if not root.is_dir():
        pytest.fail(f"MATBENCH_DATA names {str(root)!r}, which is no folder")
    return root.resolve()


@pytest.fixture(scope="session")
def real(data_root: Path) -> "Real":
    """The folder of real scenes for a test that says what it needs of it: ``real("middlebury2003/teddy")``."""
    from real import Real

    return Real(data_root)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> "Iterator[Desk]":
    """Where the commands that the documentation shows are run."""
    from following import Desk

    with pytest.MonkeyPatch.context() as patch:
        yield Desk(tmp_path_factory.mktemp("desk"), patch)


@pytest.fixture
def report() -> "Report":
    """A small run, made up, with hostile names."""
    from made_up import made_up

    return made_up()


@pytest.fixture
def homeless(monkeypatch: pytest.MonkeyPatch) -> None:
    """A person without HOME, of whom the system's list of users knows nothing."""
    for name in ("HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "MATBENCH_DATA", "NUMBA_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    pwd = pytest.importorskip("pwd", reason="homes are named otherwise here")

    def unknown(_: object) -> None:
        raise KeyError

    monkeypatch.setattr(pwd, "getpwuid", unknown)


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    """A Dask cluster without any workers yet."""
    need("dask")
    place = tmp_path / "elsewhere"
    place.mkdir()
    found = Machines(place)
    yield found
    found.close()


@pytest.fixture(scope="module")
def smaller() -> Iterator[dict[str, check_scenes.Trial]]:
    """What `check` tries, on scenes of two thirds the size."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("EASY", "EITHER_SIGN"):
            patch.setattr(check_scenes, name, getattr(check_scenes, name).replace("]", " size=160x120]"))
        check_scenes.trials.cache_clear()
        yield dict(check_scenes.trials())
    check_scenes.trials.cache_clear()


class Site:
    """A web server on this machine with whatever faults a test asks for.

    Attributes
    ----------
    files
        Path -> content; `folder` holds further files.
    faults
        Path -> what happens to the next requests, one fault each, the last one again and again if
        it is in `forever`: an int is a status; ``("busy", t)`` is 503 with ``Retry-After: t``;
        ``("cut", n)`` breaks off after n bytes of the reply; ``("stall", n)`` says nothing more after n
        bytes; ``("slow", n, s)`` waits s seconds before each further kibibyte after n bytes, and
        ``("slow", n, s, m)`` before each further m bytes; ``("headers", {...})`` replaces what is said of
        the body.
    moved
        Path -> where it is redirected to.
    ranges
        Does it send parts of files when it is asked to?
    requests
        (path, Range header or None, bytes of body sent) of every request, in order.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.files: dict[str, bytes] = {}
        self.faults: defaultdict[str, list[object]] = defaultdict(list)
        self.forever: set[str] = set()
        self.ranges = True
        self.moved: dict[str, str] = {}
        self.requests: list[list[object]] = []
        self.counting: set[int] = set()
        self.released = threading.Event()
        site = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                site.answer(self)

            def log_message(self, *_: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        threading.Thread(target=self.server.serve_forever, args=(0.05,), daemon=True).start()
        self.url = f"http://127.0.0.1:{self.server.server_port}/"

    def close(self) -> None:
        self.released.set()
        self.server.shutdown()
        self.server.server_close()

    def sent(self, path: str) -> list[tuple[object, ...]]:
        """What of `requests` was of that path; a reply may be read before it is counted."""
        end = time.monotonic() + 5
        while self.counting and time.monotonic() < end:
            time.sleep(0.01)
        return [tuple(rest) for name, *rest in self.requests if name == path]

    def _content(self, path: str) -> bytes | None:
        if path in self.files:
            return self.files[path]
        if self.folder is not None and (self.folder / path).is_file():
            return (self.folder / path).read_bytes()
        return None

    def answer(self, to: BaseHTTPRequestHandler) -> None:
        path = to.path.lstrip("/")
        asked = to.headers.get("Range")
        entry: list[object] = [path, asked, 0]
        self.counting.add(id(entry))
        self.requests.append(entry)
        faults = self.faults[path]
        fault = None if not faults else faults[0] if len(faults) == 1 and path in self.forever else faults.pop(0)
        content = self._content(path)
        wait = None
        if isinstance(fault, tuple) and fault[0] == "busy":
            fault, wait = 503, fault[1]
        status = fault if isinstance(fault, int) else 200 if content is not None else 404
        body, headers = b"" if status >= 300 or content is None else content, {}
        if asked and status == 200 and self.ranges:
            first = int(asked.removeprefix("bytes=").rstrip("-"))
            if first >= len(body):
                status, headers, body = 416, {"Content-Range": f"bytes */{len(body)}"}, b""
            else:
                status, headers = 206, {"Content-Range": f"bytes {first}-{len(body) - 1}/{len(body)}"}
                body = body[first:]
        if path in self.moved:
            status, headers = 302, {"Location": self.moved[path]}
        headers["Content-Length"] = str(len(body))
        headers["Retry-After"] = wait
        kind, *rest = fault if isinstance(fault, tuple) else (None,)
        if kind == "headers":
            headers |= rest[0]
        to.send_response(status)
        for name, value in headers.items():
            if value is not None:
                to.send_header(name, value)
        to.end_headers()
        try:
            whole = rest[0] if kind in ("cut", "stall", "slow") else len(body)
            to.wfile.write(body[:whole])
            to.wfile.flush()
            entry[2] = min(whole, len(body))
            if kind == "stall":
                self.counting.discard(id(entry))
                self.released.wait(60)
            if kind == "slow":
                piece = rest[2] if len(rest) > 2 else 1024
                for at in range(whole, len(body), piece):
                    if self.released.wait(rest[1]):
                        return
                    to.wfile.write(body[at : at + piece])
                    to.wfile.flush()
                    entry[2] = min(at + piece, len(body))
        except OSError:  # the other side has gone
            pass
        finally:
            self.counting.discard(id(entry))
        to.close_connection = True


@pytest.fixture
def serve() -> Iterator[Callable[..., Site]]:
    """Start web servers that end with the test."""
    sites: list[Site] = []

    def start(folder: Path | None = None) -> Site:
        sites.append(Site(folder))
        return sites[-1]

    yield start
    for site in sites:
        site.close()


@pytest.fixture
def site(serve: Callable[..., Site]) -> Site:
    """One web server, empty."""
    return serve()
