"""What `compare` shows: progress, tables within the width, and what a script gets instead."""

import json
import os
import pty
import re
import select
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from places import METHODS

from matbench.cli import main
from matbench.reports import tables

LINE = ["compare", "-a", "flat", "raises", "--plugin", str(METHODS), "-s", "synthetic/box[size=96x72 noise=0,4]"]


LINE += ["--out", "run"]


PLAIN = {name: value for name, value in os.environ.items() if name not in ("FORCE_COLOR", "NO_COLOR", "COLUMNS")}


def in_terminal(*tokens: str, folder: Path) -> tuple[int, str]:
    """Exit status and everything that is written to a terminal of 60 columns whose owner wants no colours."""
    ours, theirs = pty.openpty()
    line = [sys.executable, "-m", "matbench", *tokens]
    known = PLAIN | {"TERM": "xterm-256color", "COLUMNS": "60", "NO_COLOR": "1"}
    process = subprocess.Popen(line, cwd=folder, env=known, stdin=theirs, stdout=theirs, stderr=theirs)
    os.close(theirs)
    said, until = b"", time.monotonic() + 300
    while time.monotonic() < until:
        if select.select([ours], [], [], 0.2)[0]:
            try:
                said += os.read(ours, 65536)
            except OSError:  # its last writer has gone
                break
    os.close(ours)
    return process.wait(60), said.decode()


def test_a_run_speaks_to_people_and_to_scripts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def matbench(*tokens: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stop:
            main([*LINE, *tokens])
        said = capsys.readouterr()
        return int(stop.value.code or 0), said.out, said.err

    status, said = in_terminal(*LINE, folder=tmp_path)
    assert status == 1
    assert re.search(r"\d/4 cells", said)
    assert "left" in said
    assert "\x1b[" in said, "it is redrawn"
    assert not re.search(r"\x1b\[(?:\d+;)*(?:3[0-8]|9[0-7])[;m]", said), "colours"

    for name in ("FORCE_COLOR", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.chdir(tmp_path)
    status, out, err = matbench()
    assert (status, err) == (1, "")
    assert "\x1b" not in out
    printed = [line for line in out.partition("scores: ")[0].splitlines() if not re.match(r" *\d+/4 ", line)]
    assert max(map(len, printed)) <= 60
    assert "4/4  failed  raises" in out

    status, out, err = matbench("--quiet")
    assert (status, out) == (1, "run\n")
    assert err.count("matbench: failed: raises on synthetic/box[") == err.count("\n") == 2

    status, out, err = matbench("--json")
    assert status == 1
    assert "failed  raises on" in err
    facts = json.loads(out)
    assert facts["cells"] == {"ok": 2, "failed": 2}
    assert facts["metric"] == {"name": "total_bad_1", "unit": "%", "better": "lower"}
    said = r"ArithmeticError: the third digit is missing and more \(methods\.py:\d+\) \(log: cells/\w+/log\.txt\)"
    assert all(re.fullmatch(said, one["reason"]) for one in facts["unscored"])
    results, cells = (pd.read_csv(tmp_path / "run" / name) for name in ("results.csv", "cells.csv"))
    summary = tables.summary(results, cells)
    assert [row["method"] for row in facts["table"]] == summary.index.tolist() == ["flat", "raises"]
    assert facts["table"][0]["regions"]["all"] == pytest.approx(summary.loc["flat", "total_bad_1 all"])
    assert facts["table"][1]["regions"]["all"] is None
    assert all((tmp_path / path).exists() for path in facts["files"].values())


def test_a_run_without_a_single_score_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever is asked of it; not that a metric is unknown."""
    monkeypatch.chdir(tmp_path)
    scene = "synthetic/box[size=64x48]"

    def matbench(*tokens: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(tokens)
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), " ".join(out.split()), err

    said = f"no cell of this run has a score (2 failed): raises on {scene}: ArithmeticError: the third digit"
    asked = ("-a", "raises", "bare", "-s", scene, "--plugin", str(METHODS), "--out", "run")
    status, out, _ = matbench("compare", *asked)
    assert status == 1
    assert said in out
    assert "by region" not in out, "no table of dashes"
    assert "2 cells without a score" in out
    status, out, _ = matbench("score", "run")
    assert status == 0
    assert said in out
    for more in ([], ["--format", "md"], ["--format", "tex", "-m", "bad_2"], ["--out", "table.csv"]):
        status, out, err = matbench("report", "run", *more)
        assert (status, out) == (2, "")
        assert err.startswith(f"matbench: {said}")
        assert err.count("\n") == 1
    assert not Path("table.csv").exists()
    status, out, err = matbench("figure", "maps", "run", "--out", "maps")
    assert (status, out) == (2, "")
    assert f"none of 2 cells is ok; raises on {scene}: failed ArithmeticError" in err
    assert not list(Path().glob("maps*"))
    status, out, err = matbench("figure", "slice", "run", f"raises on {scene}", "--plugin", str(METHODS))
    assert (status, err.count("\n")) == (2, 1)
    assert f"raises on {scene} failed: ArithmeticError: the third digit is missing and more (methods.py:" in err
