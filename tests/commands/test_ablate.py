"""`matbench ablate`: from the command line to its table."""

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from compared import SMALL
from places import METHODS


def test_a_pattern_leaves_out_what_its_scenes_have_not(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "matbench", "ablate", "flat", "--plugin", str(METHODS), "--out", "run"]
    line += ["-s", "synthetic/b*[size=48x36 views=2,3,5,9]", "-s", "synthetic/c*[size=48x36 views=2,3,5,9]"]
    line += ["-s", "synthetic/box[size=48x36 n=9 views=2,3,5,9]"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    first = done.stdout.splitlines()[0]
    assert first.startswith("without synthetic/box[size=48x36 views=9], synthetic/curved[size=48x36 views=9]: ")
    assert "curves: run/sweeps.csv" in done.stdout
    assert not (tmp_path / "run" / "ablation.csv").exists(), "no parameter of the method varies"
    table = pd.read_csv(tmp_path / "run" / "sweeps.csv", keep_default_na=False)
    assert set(table["values"]) == {"2 3 5", "2 3 5 9"}


def test_an_ablation_from_the_command_line(tmp_path: Path) -> None:
    request = tmp_path / "level.toml"
    request.write_text(f'algorithms = ["flat[value=1,2,3]"]\nscenes = ["{SMALL}"]\n')
    line = [sys.executable, "-m", "matbench", "ablate", str(request), "--plugin", str(METHODS), "--out", "run"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "too few scenes" in done.stdout
    table = pd.read_csv(tmp_path / "run" / "ablation.csv").set_index(["level", "region", "metric"])
    scores = (
        pd.read_csv(tmp_path / "run" / "results.csv", keep_default_na=False, na_values={"value": [""]})
        .set_index(["params", "region", "metric"])
        .value
    )
    change = scores["value=3.0", "all", "avg"] - scores["value=1.0", "all", "avg"]
    assert table.loc[(3.0, "all", "avg"), "change"] == pytest.approx(change)
    assert "What each switch does" in (tmp_path / "run" / "report.html").read_text()
