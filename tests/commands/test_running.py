"""What `compare` shows: progress, tables within the width, and what a script gets instead."""

import io
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
from matbench.commands.console import Console
from matbench.commands.progress import SHOWN, Progress
from matbench.plans.plan import Cell, Method
from matbench.reports import tables, terminal
from matbench.runs.outcome import Outcome

LINE = ["compare", "-a", "flat", "raises", "--plugin", str(METHODS), "-s", "synthetic/box[size=96x72 noise=0,4]"]
LINE += ["--out", "run"]
PLAIN = {name: value for name, value in os.environ.items() if name not in ("FORCE_COLOR", "NO_COLOR", "COLUMNS")}


def cell(number: int, algorithm: str = "flat") -> Cell:
    return Cell(Method(algorithm, {}), f"synthetic/{'box' * 20}{number}", "", 0, f"{algorithm}{number}")


def shown(progress: Progress, width: int = 60) -> str:
    console = Console(width=width, file=io.StringIO(), record=True, no_color=True)
    console.print(progress._shown())
    return console.export_text()


def test_progress_names_what_runs_and_counts_what_is_left() -> None:
    now = [0.0]
    fast, slow = [cell(k) for k in range(6)], [cell(k, "slow") for k in range(2)]
    progress = Progress(None, [*fast, *slow], done=2, clock=lambda: now[0])
    progress("start", fast[0], None)
    progress("start", slow[0], None)  # several at once, as with --jobs
    assert progress.seconds_left() is None
    text = shown(progress)
    assert "2/10 cells" in text
    assert "left" not in text
    assert "flat on synthetic/box" in text
    assert "slow on synthetic/box" in text
    assert all(len(line) <= 60 for line in text.splitlines())
    now[0] = 3.0
    progress("done", fast[0], Outcome("ok", seconds=0.1))
    # one of slow runs for 3 s already and is taken to need the mean of what is known: 5 * 3 + 3, two at once
    assert progress.seconds_left() == pytest.approx((5 * 3 + 3) / 2)
    now[0] = 33.0
    progress("done", slow[0], Outcome("timeout", reason="took more than 30 s"))
    # five of 3 s and one of 33 s are waiting: two at once cannot be quicker than the longest
    assert progress.seconds_left() == pytest.approx(33)
    assert "4/10 cells · 1 failed · about 33 s left" in shown(progress, 70)
    for one in (*fast[1:], slow[1]):
        progress("start", one, None)
    assert len(progress._running) == 6
    for one in (*fast[1:], slow[1]):
        progress("done", one, Outcome("ok"))
    assert progress.seconds_left() == 0
    assert progress.done == progress.total == 10


def test_many_cells_at_once_stay_a_few_lines() -> None:
    many = [cell(k) for k in range(SHOWN + 5)]
    progress = Progress(None, many)
    for one in many:
        progress("start", one, None)
    lines = shown(progress).splitlines()
    assert len(lines) == SHOWN + 2
    assert lines[-1].strip() == "and 5 more"


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


def test_cells_that_fail_alike_share_a_row() -> None:
    names = ["algorithm", "params", "scene", "seed", "status", "seconds", "peak_mb", "reason"]
    rows = [
        ("raises", "", f"synthetic/s{k}", 0, "failed", None, None, f"no digits (log: cells/{k:016x}/log.txt)")
        for k in range(9)
    ]
    cells = pd.DataFrame([*rows, ("slow", "", "synthetic/s1", 0, "timeout", None, None, "")], columns=names)
    results = pd.DataFrame(columns=["algorithm", "params", "scene", "region", "metric", "value", "unit"])
    console = Console(width=80, file=io.StringIO(), record=True)
    console.print(terminal.tables(results, cells)[-1])
    text = console.export_text()
    assert "10 cells without a score" in text
    assert "and 6 more" in text
    assert text.count("no digits") == 1
    assert "cells/0000000000000000/log.txt" in "".join(text.split()), "that of the first"
    assert "timeout" in text


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
