"""Opening recordings: with the real viewer, served to a browser that the test stands in for."""

import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest

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


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent as a POSIX signal")
def test_the_web_viewer_answers_and_ends_with_ctrl_c(path: Path, tmp_path: Path) -> None:
    code = f"from pathlib import Path; from matbench.recording.viewer import view; view(Path({str(path)!r}), web=True)"
    # no browser: the viewer must not open one in a test
    quiet = {**os.environ, "BROWSER": "true", "HOME": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=quiet) as served:
        assert served.stdout is not None
        try:
            address = served.stdout.readline().split()[0]
            with urllib.request.urlopen(address, timeout=60) as page:  # noqa: S310
                assert page.status == 200
            served.send_signal(signal.SIGINT)
            assert served.wait(timeout=60) == 0
        finally:
            served.kill()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(address, timeout=10)  # noqa: S310
