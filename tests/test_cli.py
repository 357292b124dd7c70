"""The command line as a person types it: help, lists, and everything one can get wrong."""

import json
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from places import METHODS

from matbench.cli import main

SMALL = "synthetic/box[size=96x72]"


def run(capsys: pytest.CaptureFixture[str], *tokens: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stop:
        main(tokens)
    said = capsys.readouterr()
    return int(stop.value.code or 0), said.out, said.err


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["-a", "sgmb"], "unknown algorithm 'sgmb': did you mean 'sgbm'?"),
        (["-a", "sgbm[fil=no]"], "unknown parameter 'fil' of sgbm: did you mean 'fill'?"),
        (["-a", "sgbm[fill=maybe]"], "sgbm: fill=maybe is not true or false"),
        (["-a", "sgbm[speckle_window=0 speckle_range=3]"], "speckle_range=3 changes nothing here: it takes speckle_w"),
        (["-a", "materiality[count=0.3]"], "materiality: count=0.3 changes nothing here: it takes optimiser=gradient"),
        (["-a", "sgbm["], "cannot read 'sgbm['"),
        (["-s", "middelbury2003/teddy"], "unknown dataset 'middelbury2003': did you mean 'middlebury2003'?"),
        (["-s", "synthetic/bx"], "unknown"),
        (["-s", "synthetic/box[view=1]"], "unknown"),
        (["-s", "synthetic/no*"], "no scene 'synthetic/no*' exists"),
        (["-s", "box"], "scene 'box' has no dataset"),
        (["-m", "bad_3"], "unknown metric 'bad_3'"),
        (["--data", "/no/such/folder"], "data folder '/no/such/folder' (--data) does not exist"),
        (["--plugin", "/no/such.py"], "plug-in file '/no/such.py' does not exist"),
        (["--seed=-1"], "seed '-1' is not a whole number"),
        (["--seed", "x"], "seed 'x' is not a whole number"),
        (["--seed", "1.5"], "seed '1.5' is not a whole number"),
        (["--row", "5"], "--row 5 chooses what recordings show: add --record"),
        (["--row", "1.5", "--record"], "row '1.5' is not a whole number"),
        (["--row", "72", "--record"], "row 72 of synthetic/box[size=96x72]: 0 to 71 is possible"),
        (["-s", "synthetic/box[views=9]"], "views=9 of synthetic/box: it has 5 views, 2 to 5 is possible"),
        (["-s", "synthetic/*[views=9]"], "no scene has the views asked for: synthetic/box[views=9]"),
        (["-s", "synthetic/box[disparities=9:1]"], "disparities=9:1 of synthetic/box: LEAST:LARGEST"),
        (["--bogus"], "Unknown option"),
        (["stray"], "'stray' belongs to no option of matbench compare"),
        (["-s", "synthetic/box[predct=left]"], "unknown option 'predct' of synthetic/box: did you mean 'predict'?"),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tokens: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = [] if "-s" in tokens else ["-s", SMALL]
    status, _, err = run(capsys, "compare", *tokens, *scene)
    assert status == 2
    assert said in err
    assert err.count("\n") == 1
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []  # nothing half-written


def test_compare_prints_tables_and_says_where_things_are(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, out, _ = run(
        capsys,
        "compare",
        "-a",
        "flat",
        "flat[value=3]",
        "--plugin",
        str(METHODS),
        "-s",
        SMALL,
        "--out",
        str(tmp_path / "r"),
    )
    assert status == 0
    assert "flat[value=3.0]" in out
    assert str(tmp_path / "r" / "report.html") in out
    assert {p.name for p in (tmp_path / "r").iterdir()} == {
        ".lock",
        "plan.json",
        "cells",
        "scores.json",
        "results.csv",
        "cells.csv",
        "report.html",
    }


def test_a_failed_cell_is_status_1_and_says_why(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, out, _ = run(
        capsys, "compare", "-a", "flat", "raises", "--plugin", str(METHODS), "-s", SMALL, "--out", str(tmp_path / "r")
    )
    assert status == 1
    assert f"failed  raises on {SMALL} ArithmeticError: the third digit is missing" in out


def test_missing_real_scenes_are_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MATBENCH_DATA", raising=False)
    line = ["compare", "-a", "flat", "--plugin", str(METHODS), "--out", str(tmp_path / "r")]
    status, out, _ = run(capsys, *line)
    assert status == 0
    first = out.splitlines()[0]
    assert all(name in first for name in ("tsukuba", "Rocks1", "teddy", "--data", "matbench fetch paper"))


def test_list_names_everything(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "list", "--json", "--plugin", str(METHODS))
    known = json.loads(out)
    assert status == 0
    assert {"materiality", "multiview_sgm", "okutomi_kanade", "sgbm", "voxel_coloring", "flat"} <= set(
        known["algorithms"]
    )
    assert known["algorithms"]["flat"]["parameters"] == {"value": {"type": "a number", "default": 1.0}}
    assert "paper" in known["algorithms"]["materiality"]["presets"]
    grouped = {name: one["group"] for name, one in known["algorithms"]["materiality"]["parameters"].items()}
    assert set(grouped.values()) == {"matching", "inference", "solver", "energy"}
    assert (grouped["pairs"], grouped["mending"], grouped["passes"], grouped["count"]) == tuple(
        dict.fromkeys(grouped.values())
    )
    assert known["scenes"]["middlebury2003/teddy"]["sizes"]["quarter"] == [450, 375]
    assert known["scenes"]["synthetic/box"]["present"] is True
    truths = {name: known["scenes"][f"middlebury2005/{name}"]["truth"] for name in ("Art", "Computer", "Drumsticks")}
    assert truths == {"Art": True, "Computer": False, "Drumsticks": False}
    assert known["metrics"]["total_bad_1"]["unit"] == "%"
    status, out, _ = run(capsys, "list")
    assert status == 0
    assert all(word in out for word in ("materiality", "preset=paper", "middlebury2003/teddy", "total_bad_1"))
    lines = [line.strip("│ ") for line in out.splitlines()]
    energy = lines.index("energy:")
    assert lines[energy + 1] == "count=0.3: a number"


PLUGINS = """\
[matbench.algorithms]
leaves = broken_package.leaves:X
number = broken_package.odd:number
hint = broken_package.odd:Hint
[matbench.datasets]
odd = broken_package.odd:number
[matbench.metrics]
missing = broken_package.odd:missing
odd = broken_package.odd:number
failing = broken_package.odd:failing
"""
ODD = """\
from matbench.measures.metrics import Metric
number = 3
failing = Metric("failing", "px", "lower", "always fails", lambda errors: 1 / 0)
class Hint:
    def __init__(self, x: "nowhere.to.be.found" = 3): pass
    def solve(self, scene, context): pass
"""


def test_broken_plugins_are_listed_with_their_errors_and_harm_nothing(tmp_path: Path) -> None:
    package = tmp_path / "site" / "broken_package"
    facts = tmp_path / "site" / "broken_package-1.0.dist-info"
    package.mkdir(parents=True)
    facts.mkdir()
    (package / "__init__.py").write_text("")
    (package / "leaves.py").write_text("import sys\nsys.exit(3)\n")
    (package / "odd.py").write_text(ODD)
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: broken-package\nVersion: 1.0\n")
    (facts / "entry_points.txt").write_text(PLUGINS)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}

    def matbench(*tokens: str) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-m", "matbench", *tokens]
        return subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)

    listed = matbench("list", "--json")
    assert listed.returncode == 0, listed.stderr
    known = json.loads(listed.stdout)
    assert "SystemExit: 3" in known["algorithms"]["leaves"]["error"]
    assert "no class" in known["algorithms"]["number"]["error"]
    assert "nowhere" in known["algorithms"]["hint"]["error"]
    assert "AttributeError" in known["scenes"]["odd"]["error"]
    assert "missing" in known["metrics"]["missing"]["error"]
    assert matbench("list").returncode == 0
    done = matbench("compare", "-a", "sgbm", "-s", SMALL, "--out", "run")
    assert done.returncode == 0, done.stderr
    assert "failing" in (tmp_path / "run" / "results.csv").read_text()


def test_who_stops_reading_is_no_error(tmp_path: Path) -> None:
    line = f"{sys.executable} -m matbench list | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, timeout=60)
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


def test_a_truncated_image_is_found_before_anything_is_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, data_root: Path
) -> None:
    source = data_root / "middlebury/scenes2001/data/tsukuba"
    place = tmp_path / "data/middlebury/scenes2001/data/tsukuba"
    place.mkdir(parents=True)
    for file in source.iterdir():
        (place / file.name).write_bytes(file.read_bytes())
    broken = place / "scene1.row3.col2.ppm"
    broken.write_bytes(broken.read_bytes()[:1000])
    line = ["compare", "-a", "sgbm", "-s", "middlebury2001/tsukuba", "--data", str(tmp_path / "data")]
    status, _, err = run(capsys, *line, "--out", str(tmp_path / "r"))
    assert status == 2
    assert "scene1.row3.col2.ppm" in err
    assert err.count("\n") == 1
    assert not (tmp_path / "r").exists()


def test_a_metric_that_nothing_measured_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(
            [
                "compare",
                "-a",
                "sgbm",
                "-s",
                "synthetic/box[size=96x64]",
                "-m",
                "prediction_psnr",
                "--out",
                str(tmp_path / "run"),
            ]
        )
    assert stop.value.code == 0
    assert "prediction_psnr was not measured" in " ".join(capsys.readouterr().out.split())
