"""Times and memory that a method would rather not tell, through the command line's own way to solve."""

import re
from pathlib import Path

import pandas as pd
import pytest

import matbench
from matbench import comparison
from matbench.cli import main
from matbench.plans.settings import Settings
from matbench.solving import confinement

SCENE = "synthetic/box[size=240x180]"

SLY = '''
import os
import time
import re
from pathlib import Path

import numpy as np

from matbench import Estimate

_KNOWN = {}


def _flat(scene):
    return Estimate({scene.ref: np.zeros((scene.height, scene.width), np.float32)})


def _is_tiny(scene):
    return scene.height <= 16


class Remembers:
    """Refuses the small warm-up, so that it gets a larger one, and takes its time for what it has not seen."""

    def solve(self, scene, context):
        if _is_tiny(scene):
            raise ValueError("too small")
        key = scene.views.tobytes()
        if key not in _KNOWN:
            time.sleep(0.3)
            _KNOWN[key] = _flat(scene)
        return _KNOWN[key]


class Stops:
    """Stops the clock."""

    def solve(self, scene, context):
        if not _is_tiny(scene):
            begin = time.perf_counter()
            time.perf_counter = lambda: begin
            import matbench.solving.worker as worker

            worker.perf_counter = time.perf_counter
            time.sleep(0.5)
        return _flat(scene)


class Holds:
    """Holds memory in a file that nobody has mapped."""

    def solve(self, scene, context):
        if not _is_tiny(scene):
            number = os.memfd_create("held")
            for _ in range(1200):
                os.write(number, bytes(1 << 20))
            time.sleep(2)
        return _flat(scene)


class Leaves:
    """Leaves a file in shared memory."""

    def solve(self, scene, context):
        Path("/dev/shm/matbench-test-left").write_bytes(bytes(1 << 16))
        return _flat(scene)
'''


@pytest.fixture
def sly(tmp_path: Path) -> Path:
    path = tmp_path / "sly.py"
    path.write_text(SLY)
    return path


def solved(sly: Path, name: str, settings: Settings = Settings()) -> pd.Series:
    """The row of the one cell's table."""
    ready = comparison.prepare(name, SCENE, plugin=sly, out=sly.parent / "run", settings=settings)
    ready.run()
    row: pd.Series = ready.tables().cells.iloc[0]
    return row


def test_the_warm_up_never_sees_the_scene_that_is_timed(sly: Path) -> None:
    row = solved(sly, "remembers")
    assert row.status == "ok"
    assert row.seconds > 0.29
    assert row.warmup_seconds > 0.29


def test_a_clock_that_is_stopped_is_not_believed(sly: Path) -> None:
    row = solved(sly, "stops")
    assert row.status == "ok"
    assert row.seconds > 0.49
    assert "its process counted" in row.doubt


def test_memory_counts_in_files_that_nobody_has_mapped(sly: Path) -> None:
    row = solved(sly, "holds", Settings(memory="300M"))
    assert row.status == "out-of-memory"
    assert "300 MiB are its limit" in row.reason


def test_nothing_is_left_in_shared_memory(sly: Path) -> None:
    left = Path("/dev/shm/matbench-test-left")  # noqa: S108
    assert solved(sly, "leaves").status == "ok"
    if confinement.is_possible():
        assert not left.exists()
    else:  # written and closed at once: nobody could see it open
        left.unlink(missing_ok=True)


def test_what_settings_ask_for_is_done(sly: Path) -> None:
    out = sly.parent / "run"
    matbench.compare("voxel_coloring", "synthetic/box[size=48x36]", out=out, settings=Settings(volumes=True))
    assert list(out.glob("cells/*/volume.npz"))


def rows_shown(run: Path) -> set[int]:
    """The image rows whose slices a report shows."""
    return {int(row) for row in re.findall(r'"row": ?(\d+)', (run / "report.html").read_text())}


def test_recorded_rows_stay_on_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["compare", "-a", "sgbm", "-s", "synthetic/box[size=96x72]", "--out", str(tmp_path / "run")]
    for tokens in ([*line, "--record", "slices", "--rows", "33"], ["score", str(tmp_path / "run")], line):
        with pytest.raises(SystemExit) as ended:
            main(tokens)
        assert ended.value.code == 0, capsys.readouterr().err
        assert 33 in rows_shown(tmp_path / "run")
