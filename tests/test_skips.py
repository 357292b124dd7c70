"""What is skipped for want of a tool or a scene is counted, and fails where it must be there."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT
from real import Real
from tools import ADVICE, VARIABLE, find

NEEDS_TEX = "tests/reports/test_switches.py::test_latex_compiles"


def ran(*tests: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A run of some tests, where no program is found."""
    line = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *tests]
    env = {**os.environ, "PATH": os.devnull, **environment}
    return subprocess.run(line, cwd=ROOT, env=env, capture_output=True, text=True, timeout=120)


def test_what_is_skipped_is_counted_by_reason() -> None:
    done = ran(NEEDS_TEX, "tests/datasets/test_make_registry.py", MATBENCH_DATA="")
    assert done.returncode == 0, done.stdout
    assert "2 skipped, by reason" in done.stdout
    assert f"   1  {ADVICE['tex']}\n" in done.stdout
    assert "   1  MATBENCH_DATA is not set: no real scenes\n" in done.stdout


def test_where_a_tool_is_asked_for_its_absence_fails() -> None:
    done = ran(NEEDS_TEX, **{VARIABLE: "dask,tex"})
    assert done.returncode == 1
    assert f"{ADVICE['tex']}, and {VARIABLE} asks for it" in done.stdout


def test_a_tool_is_there_with_all_its_programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    for name in ("google-chrome", "chromedriver"):
        assert find("browser") == []
        (tmp_path / name).touch(mode=0o755)
    assert find("browser") == [str(tmp_path / "google-chrome"), str(tmp_path / "chromedriver")]
    assert find("tex") == []


def test_a_scene_is_there_or_its_tests_are_skipped(tmp_path: Path) -> None:
    (tmp_path / "middlebury" / "eval_v2").mkdir(parents=True)
    real = Real(tmp_path)
    assert real("middlebury/eval_v2", "synthetic/box") == tmp_path
    for name in ("middlebury2003/teddy", "middlebury2003/teddy[size=half]", "hci/antinous", "manifest.json", "no/such"):
        with pytest.raises(pytest.skip.Exception) as told:
            real(name)
        assert told.value.msg == f"no {name} among the real scenes"
