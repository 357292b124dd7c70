"""`matbench score`: scores made again from stored maps, wherever they come from."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from finished_runs import done
from typing_commands import run

from matbench.results.archive import export
from matbench.runs.store import Store


def test_scoring_runs_no_code_that_a_run_folder_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = done(tmp_path / "run", "flat")
    plan = json.loads((folder / "plan.json").read_text())
    evil = tmp_path / "evil.py"
    evil.write_text(f"open({str(tmp_path / 'executed')!r}, 'w')\n")
    plan["plugin_files"] = [str(evil)]
    plan["cells"][0]["method"]["algorithm"] = str(evil)
    (folder / "plan.json").write_text(json.dumps(plan))
    status, out, err = run(capsys, "score", folder)
    assert status == 0, err
    assert "byte for byte" not in out, "the method is called otherwise now"
    assert not (tmp_path / "executed").exists()


def test_the_archive_is_checked_in_another_process_without_the_run(tmp_path: Path) -> None:
    folder = done(tmp_path / "run", "flat")
    archive, _ = export(folder)
    folder.rename(tmp_path / "gone")
    line = [sys.executable, "-m", "matbench", "score", str(archive)]
    told = subprocess.run(line, capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    assert Store(tmp_path / "gone").command() == "typed"


def test_metrics_that_are_asked_for_anew_are_no_changed_scores(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    archive, _ = export(done(tmp_path / "run", "flat"))
    status, out, err = run(capsys, "score", archive, "-m", "bad_3")
    assert status == 0, err
    assert "metrics that were not there before: bad_3, total_bad_3" in out
    assert "the scores are what they were, byte for byte" in out
