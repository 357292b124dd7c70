"""`matbench compare`: what it prints, and everything one can get wrong."""

from pathlib import Path

import pytest
from places import METHODS
from real import Real
from typing_commands import SMALL, run

from matbench.cli import main


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
        (["-m", "bad_x"], "unknown metric 'bad_x'"),
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


def test_a_truncated_image_is_found_before_anything_is_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, real: Real
) -> None:
    source = real("middlebury2001/tsukuba") / "middlebury/scenes2001/data/tsukuba"
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
