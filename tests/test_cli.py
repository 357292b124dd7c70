"""The command line as a person types it: help, lists, and everything one can get wrong."""

import json
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from matbench.cli import main

METHODS = Path(__file__).with_name("methods.py")
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
        (["-a", "sgbm[fil=no]"], "unknown parameter of sgbm 'fil': did you mean 'fill'?"),
        (["-a", "sgbm[fill=maybe]"], "sgbm: fill=maybe is not true or false"),
        (["-a", "sgbm["], "cannot read 'sgbm['"),
        (["-s", "middelbury2003/teddy"], "unknown dataset 'middelbury2003': did you mean 'middlebury2003'?"),
        (["-s", "synthetic/bx"], "unknown"),
        (["-s", "synthetic/box[view=1]"], "unknown"),
        (["-s", "synthetic/no*"], "no scene 'synthetic/no*' exists"),
        (["-s", "box"], "scene 'box' has no dataset"),
        (["-m", "bad_3"], "unknown metric 'bad_3'"),
        (["--data", "/no/such/folder"], "data folder '/no/such/folder' (--data) does not exist"),
        (["--plugin", "/no/such.py"], "plug-in file '/no/such.py' does not exist"),
        (["--seed", "-1"], "seed"),
        (["--seed", "x"], "Invalid value"),
        (["--bogus"], "Unknown option"),
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
        "plan.json",
        "cells",
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
    assert all(name in first for name in ("tsukuba", "Rocks1", "teddy", "--data"))


def test_list_names_everything(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "list", "--json", "--plugin", str(METHODS))
    known = json.loads(out)
    assert status == 0
    assert {"materiality", "multiview_sgm", "okutomi_kanade", "sgbm", "voxel_coloring", "flat"} <= set(
        known["algorithms"]
    )
    assert known["algorithms"]["flat"]["parameters"] == {"value": {"type": "a number", "default": 1.0}}
    assert "paper" in known["algorithms"]["materiality"]["presets"]
    assert known["scenes"]["middlebury2003/teddy"]["sizes"]["quarter"] == [450, 375]
    assert known["scenes"]["synthetic/box"]["present"] is True
    assert known["metrics"]["total_bad_1"]["unit"] == "%"
    status, out, _ = run(capsys, "list")
    assert status == 0
    assert all(word in out for word in ("materiality", "preset=paper", "middlebury2003/teddy", "total_bad_1"))


def test_a_broken_plugin_is_listed_with_its_error_and_harms_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from importlib.metadata import EntryPoint

    from matbench import plugins

    broken = plugins.Plugin("broken", "some-package", EntryPoint("broken", "no_such_module:X", "matbench.algorithms"))
    real = plugins.installed("algorithms")
    monkeypatch.setattr(plugins, "installed", lambda group: {**real, "broken": broken} if group == "algorithms" else {})
    found = plugins.algorithms()
    from matbench.listing import _algorithm

    assert "no_such_module" in _algorithm(found["broken"])["error"]
    assert "parameters" in _algorithm(found["sgbm"])


def test_help_is_quick_and_imports_nothing_heavy() -> None:
    code = (
        "import sys, matbench.cli; print([m for m in ('numpy', 'pandas', 'numba', 'cv2', 'rerun') if m in sys.modules])"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )
    best = 9.0
    for _ in range(5):
        start = time.perf_counter()
        said = subprocess.run([sys.executable, "-m", "matbench", "--help"], capture_output=True, text=True, check=True)
        best = min(best, time.perf_counter() - start)
    assert "compare" in said.stdout
    assert best < 0.5


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
