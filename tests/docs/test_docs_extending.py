"""Whoever does what the page on extending says, from its first line to its last, gets what it says."""

import subprocess
import sys

import numpy as np
import pytest
from following import Desk, lines, shortened, table
from shown import METHOD, OWN_FILES, commands

import matbench
from matbench.measures.metrics import Metric
from matbench.plans import plugins
from matbench.results import metric_catalogue

PAGE = "docs/guides/extending.md"
RUNS = {"mine.py": {"sgbm", "mine"}, "judge.py": {"sgbm", "okutomi_kanade"}, "walls.py": {"sgbm"}}


def test_the_page_has_one_of_each_kind() -> None:
    assert list(OWN_FILES) == ["mine.py", "judge.py", "walls.py", "regions.py"]
    assert OWN_FILES["mine.py"] == METHOD


def test_the_page_can_be_followed(desk: Desk) -> None:
    shown = [line for line in commands(PAGE) if line in lines("plain")]
    for line in shown:
        said = desk.follow(shortened(line))
        if line.startswith("matbench list"):
            assert all(name in said for name in ("fine", "too_near", "roughness"))
    assert len(shown) >= 8
    for run, algorithms in zip(dict.fromkeys(desk.runs), RUNS.values(), strict=True):
        assert {row["algorithm"] for row in table(run / "results.csv")} == algorithms
    judged = {row["metric"]: row for row in table(desk.folder / "runs/judged/results.csv") if row["region"] == "all"}
    assert [judged[name]["unit"] for name in ("fine", "too_near", "roughness")] == ["%", "%", "px"]
    assert all(float(judged[name]["value"]) > 0 for name in ("fine", "too_near", "roughness"))
    walls = table(desk.folder / "runs/walls/results.csv")
    assert {row["scene"] for row in walls} == {"walls/far", "walls/near"}
    assert {row["region"] for row in walls} >= {"all", "nonocc", "occ", "disc", "textureless", "seen_in_all"}
    assert max(float(row["value"]) for row in walls if (row["metric"], row["region"]) == ("bad_1", "seen_in_all")) < 5
    assert (desk.folder / "runs/judged/maps.pdf").is_file()


@pytest.mark.parametrize("line", lines("script"), ids=str)
def test_the_figure_is_drawn(line: str, desk: Desk) -> None:
    run = desk.folder / "runs/judged"
    if not run.exists():  # this test runs alone
        matbench.compare("sgbm", "synthetic/box[size=64x48]", out=run)
    _, script, folder = line.split()
    subprocess.run([sys.executable, script, folder], cwd=desk.folder, check=True, timeout=120)
    assert (run / "regions.pdf").stat().st_size > 1000
    assert "by region" in (run / "regions.txt").read_text()


def test_what_the_page_says_of_python(desk: Desk) -> None:
    scene = matbench.load_scene("walls/near", plugin="walls.py")
    assert (scene.truth[1] == 6).all()
    table = matbench.compare(
        "mine", ["walls/far", "synthetic/box[size=64x48]"], plugin=["mine.py", "judge.py", "walls.py"], out="runs/three"
    )
    assert set(table["scene"]) == {"walls/far", "synthetic/box[size=64x48]"}
    near = table[(table["scene"] == "walls/far") & (table["region"] == "all")].set_index("metric")["value"]
    assert near["too_near"] == 100, "4 px per view step for a wall at 2"
    assert near["roughness"] == 0
    assert near["fine"] == 0


def test_metrics_are_what_they_say_worked_out_by_hand(desk: Desk) -> None:
    with plugins.using(["judge.py"]):
        found = {m.name: m for m in metric_catalogue.metrics() if isinstance(m, Metric)}
    errors = np.array([-3, 0.2, 2, np.nan])
    assert found["fine"].compute(np.abs(errors)) == 25
    assert found["too_near"].compute(errors) == 25
    with pytest.raises(matbench.UserError, match="unknown metric 'too_near'"):
        metric_catalogue.metric_named("too_near")
