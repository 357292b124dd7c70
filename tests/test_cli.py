"""The command line as a person types it: help, lists, and everything one can get wrong."""

import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from typing_commands import run


def test_who_stops_reading_is_no_error(tmp_path: Path) -> None:
    line = f"{sys.executable} -m matbench list | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")


def test_help_is_quick_and_imports_nothing_heavy() -> None:
    code = (
        "import sys, matbench.cli; print([m for m in ('numpy', 'pandas', 'numba', 'cv2', 'rerun') if m in sys.modules])"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )
    best = 9.0
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        said = subprocess.run([sys.executable, "-m", "matbench", "--help"], capture_output=True, text=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)  # what others do on the machine does not count
        best = min(best, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert "compare" in said.stdout
    assert "Download scenes" in said.stdout, "a command that is imported late has its line, too"
    assert best < 0.5


@pytest.mark.parametrize("command", ["compare", "ablate", "fetch", "list", "view", "bench"])
def test_help_teaches_by_example(capsys: pytest.CaptureFixture[str], command: str) -> None:
    status, out, _ = run(capsys, command, "--help")
    assert status == 0
    assert f"matbench {command}" in out.partition("Examples")[2]
    assert out.count("Examples") == 1


def test_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "--version")
    assert status == 0
    assert re.fullmatch(r"\d+\.\d+\.\d+", out.strip())


def test_a_metric_that_fails_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "judge.py").write_text(
        "from matbench import Metric\n"
        "def broken(errors):\n    raise ValueError('no such table')\n"
        "METRICS = [Metric('broken', '%', 'lower', 'always fails', broken)]\n"
    )
    line = f"{sys.executable} -m matbench compare --plugin judge.py -a sgbm -s 'synthetic/box[size=48x36]' -m broken -q"
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, timeout=100)
    assert done.stderr.splitlines() == ["matbench: metric broken failed: ValueError: no such table (judge.py:3)"]
