"""What is materiality's own? The proof, run small (`tests/proofs/own.py`)."""

from pathlib import Path

import pandas as pd
import pytest
from proofs import own

from matbench.algorithm import Context
from matbench.algorithms.multiview_sgm import MultiviewSGM
from matbench.measures.metrics import score
from matbench.results.metric_catalogue import metric_named
from matbench.scenes.catalogue import load_scene


def test_the_four_are_measured_once_by_the_number_of_views_that_see_a_point(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scores = tmp_path / "scores.csv"
    worlds = [f"synthetic/world[seed={seed} size=96x72 n=5]" for seed in (0, 1)]
    asked = ["measure", str(scores), *(part for name in worlds for part in ("-s", name))]
    own.main([*asked, "--part", "1/2"])
    own.main(asked)
    rows = scores.read_text().splitlines()
    own.main(asked)
    assert scores.read_text().splitlines() == rows, "nothing is measured twice"
    found = pd.read_csv(scores, names=own.COLUMNS)
    assert set(found["method"]) == set(own.SWITCHES)
    assert {f"seen_{count}" for count in range(1, 6)} <= set(found["region"])
    parts = found[found["region"].str.startswith("seen_") & (found["method"] == own.V)]
    assert (parts.groupby("scene")["pixels"].sum() == parts.groupby("scene")["known"].first()).all()

    scene = load_scene(worlds[0])
    control = MultiviewSGM(surfaces=False).solve(scene, Context()).disparity[scene.ref]
    metric, truth = metric_named(own.METRIC), scene.truth[scene.ref]
    expected = score(control, truth, scene.regions["all"], scene.pair_steps, [metric], scene)[own.METRIC]
    neither = found[(found["scene"] == worlds[0]) & (found["method"] == own.NEITHER) & (found["region"] == "all")]
    assert neither["value"].item() == pytest.approx(expected)
    own.main(["table", str(scores)])
    assert "| all | 2 |" in capsys.readouterr().out
