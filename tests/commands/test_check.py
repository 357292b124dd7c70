"""`matbench check`: what it finds of methods, wherever they come from."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from places import TESTS, UNRULY

from matbench.cli import main


def run(capsys: pytest.CaptureFixture[str], *words: str | Path) -> tuple[int, str, str]:
    """Exit status, output and errors of a command line."""
    with pytest.raises(SystemExit) as ended:
        main(list(map(str, words)))
    told = capsys.readouterr()
    return int(ended.value.code or 0), told.out, told.err


def test_the_readme_s_example_passes_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    readme = (TESTS.parent / "README.md").read_text()
    (example,) = re.findall(r"```python\n(import numpy as np\n.*?class Mine:.*?)```", readme, re.DOTALL)
    (tmp_path / "mine.py").write_text(example)
    status, out, _ = run(capsys, "check", f"{tmp_path}/mine.py[share=0,1]", "--json")
    assert status == 0
    told = json.loads(out)
    assert [one["method"] for one in told] == ["mine[share=0.0]", "mine[share=1.0]"]
    assert {check["verdict"] for one in told for check in one["checks"]} == {"pass"}


def test_a_package_that_is_installed_is_found_by_its_entry_point(tmp_path: Path) -> None:
    shutil.copytree(TESTS / "package", tmp_path / "package", ignore=shutil.ignore_patterns("__pycache__"))
    offline = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--disable-pip-version-check"]
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        *offline,
        "--target",
        str(tmp_path / "there"),
        str(tmp_path / "package"),
    ]
    subprocess.run(pip, check=True, timeout=300)
    line = [sys.executable, "-m", "matbench", "check", "middle_plane[share=0.25]"]
    env = os.environ | {"PYTHONPATH": str(tmp_path / "there")}
    ended = subprocess.run(line, capture_output=True, text=True, timeout=300, env=env)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "middle_plane[share=0.25] passes" in ended.stdout


def test_failures_and_wrong_usage_have_their_own_exit_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, _ = run(capsys, "check", "leaning", "--plugin", UNRULY)
    assert status == 1
    assert "leaning fails: mirror" in out
    for words, said in [
        ((), "no method"),
        (("sgmb",), "did you mean 'sgbm'"),
        (("middle_plane",), "unknown algorithm"),
        (("sgbm[fil=true]",), "unknown parameter"),
        (("sgbm", "--timeout", "0"), "timeout '0' is not a positive number of seconds"),
        ((str(tmp_path / "none.py"),), "does not exist"),
        (("command",), "program must be given"),
    ]:
        status, _, err = run(capsys, "check", *words)
        assert status == 2, words
        assert said in err
        assert err.count("\n") == 1
