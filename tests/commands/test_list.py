"""`matbench list`: everything by name, and what is broken with its error."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import METHODS
from typing_commands import SMALL, run


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
    assert (len(known["sets"]["worlds/quick"]), known["sets"]["paper"][0]) == (12, "middlebury2001/tsukuba")
    status, out, _ = run(capsys, "list")
    assert status == 0
    assert all(
        word in out for word in ("materiality", "preset=paper", "middlebury2003/teddy", "worlds/quick", "total_bad_1")
    )
    lines = [line.strip("│ ") for line in out.splitlines()]
    energy = lines.index("energy:")
    assert lines[energy + 1 : energy + 3] == ["form=squares: squares or linear", "count=0.3: a number"]


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
