"""Opening recordings: with the real viewer, served to a browser that the test stands in for."""

import errno
import os
import signal
import socket
import subprocess
import sys
import urllib.request
from contextlib import closing
from pathlib import Path

import numpy as np
import psutil
import pytest
from waiting import lives, wait_until

from matbench.errors import UserError
from matbench.recording.rrd import record_scene
from matbench.recording.viewer import view
from matbench.scene import Range, Scene


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    written = tmp_path_factory.mktemp("viewer") / "scene.rrd"
    record_scene(written, Scene("flat", np.zeros((2, 4, 8, 3), np.uint8), ("0", "1"), 0, Range(0, 1), {}, 1.0))
    return written


def test_view_needs_a_recording_and_a_display(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UserError, match="no recording"):
        view(path.with_name("other.rrd"), web=True)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(UserError, match="--web"):
        view(path)


def refused(port: int) -> bool:
    with closing(socket.socket()) as asks:
        return asks.connect_ex(("127.0.0.1", port)) == errno.ECONNREFUSED


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux ends a process with one that was killed")
@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_the_web_viewer_answers_and_ends_however_it_is_ended(path: Path, tmp_path: Path, by: signal.Signals) -> None:
    code = f"from pathlib import Path; from matbench.recording.viewer import view; view(Path({str(path)!r}), web=True)"
    # no browser: the viewer must not open one in a test
    quiet = {**os.environ, "BROWSER": "true", "HOME": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=quiet) as served:
        assert served.stdout is not None
        try:
            address = served.stdout.readline().split()[0]
            with urllib.request.urlopen(address, timeout=300) as page:  # noqa: S310
                assert page.status == 200
            below = [process.pid for process in psutil.Process(served.pid).children(recursive=True)]
            assert below
            served.send_signal(by)
            ended = {signal.SIGINT: 0, signal.SIGTERM: 128 + 15, signal.SIGHUP: 128 + 1, signal.SIGKILL: -9}
            assert served.wait(timeout=300) == ended[by]
        finally:
            served.kill()
    port = int(address.split(":")[2].partition("/")[0])
    wait_until(lambda: not any(map(lives, below)) and refused(port), 60, "the end of its viewer")


def test_the_viewer_ends_when_what_waits_for_it_fails(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[int] = []

    def fails(_: int, viewer: subprocess.Popen[bytes]) -> bool:
        started.append(viewer.pid)
        raise MemoryError

    monkeypatch.setattr("matbench.recording.viewer._answers", fails)
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(MemoryError):
        view(path, web=True)
    assert not any(map(lives, started))
    assert signal.getsignal(signal.SIGTERM) == before
