"""A run that is interrupted, told to end or killed, and taken up again; a script that runs once."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
from compared import SMALL, cells
from places import METHODS
from waiting import wait_until

from matbench import comparison


def test_interrupted_by_the_user_and_taken_up_again(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "flat", "slow", "--plugin", str(METHODS)]
    line += ["-s", SMALL, "--out", str(tmp_path / "run")]
    process = subprocess.Popen(
        line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    wait_until(lambda: any((tmp_path / "run" / "cells").glob("[0-9a-f]*")))
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=150)
    assert process.returncode == 130, said
    assert "the same command goes on from here" in said
    assert "Traceback" not in said
    assert cells(tmp_path).status.to_dict() == {"flat": "ok", "slow": "interrupted"}


def test_told_to_end_it_leaves_nothing_behind(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "flat", "slow", "--plugin", str(METHODS)]
    line += ["-s", SMALL, "--out", str(tmp_path / "run")]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_until(lambda: any((tmp_path / "run" / "cells").glob("[0-9a-f]*")))
    children = psutil.Process(process.pid).children(recursive=True)
    assert children
    process.terminate()
    assert process.wait(timeout=150) == 130
    assert not psutil.wait_procs(children, timeout=300)[1]
    assert not list((tmp_path / "run" / "cells").glob(".*"))


def test_killed_and_taken_up_again(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "flat", "slow", "--plugin", str(METHODS)]
    line += ["-s", SMALL, "--out", str(tmp_path / "run")]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_until(lambda: any((tmp_path / "run" / "cells").glob("[0-9a-f]*")))
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    ready = comparison.prepare(["flat", "slow"], SMALL, out=tmp_path / "run", plugin=[METHODS])
    assert ready.store.outcome(ready.plan.cells[0]).status == "ok"  # type: ignore[union-attr]
    assert [c.method.algorithm for c in ready.pending().cells] == ["slow"]


def test_a_script_without_a_main_guard_runs_once(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import matbench\n"
        "print('once')\n"
        f"table = matbench.compare('flat', {SMALL!r}, out={str(tmp_path / 'run')!r}, plugin=[{str(METHODS)!r}])\n"
        "print(len(table))\n"
    )
    said = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, check=True).stdout
    assert said.split() == ["once", str(9 * 16)]
