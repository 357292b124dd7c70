"""Do computed scenes rank methods as real ones do? The proof, run small (`tests/proofs/rankings.py`)."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from places import TESTS

sys.path.insert(0, str(TESTS / "proofs"))

import rankings


def test_scores_are_measured_once_and_ranked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scores = tmp_path / "scores.csv"
    methods = [part for name in ("sgbm", "okutomi_kanade", "okutomi_kanade[window=3]") for part in ("-a", name)]
    asked = ["measure", str(scores), "-s", "synthetic/world[seed=0,1 size=96x72 n=3]", *methods]
    rankings.main([*asked, "--part", "1/2"])
    rankings.main(asked)
    rows = scores.read_text().splitlines()
    assert len(rows) == len(set(rows)) == 2 * 3 * len(rankings.REGIONS)
    rankings.main(asked)
    assert scores.read_text().splitlines() == rows, "nothing is measured twice"
    rankings.main(["tau", str(scores), str(scores), "--decide", "sgbm", "okutomi_kanade"])
    assert "all: real scenes 2, methods 3" in capsys.readouterr().out


def table(means: list[float], scenes: int, spread: float, seed: int) -> pd.DataFrame:
    drawn = np.random.default_rng(seed).normal(means, spread, (scenes, len(means)))
    return pd.DataFrame(drawn, columns=[f"m{k}" for k in range(len(means))])


def test_tau_is_that_of_the_means_and_its_interval_knows_the_scenes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rankings, "RESAMPLES", 200)
    means = list(range(8))
    same, turned = (rankings.tau(table(means, 12, 0.01, 1), table(m, 12, 0.01, 2)) for m in (means, means[::-1]))
    assert same == pytest.approx((1, 1, 1))
    assert turned == pytest.approx((-1, -1, -1))
    best, low, high = rankings.tau(table(means, 12, 6.0, 3), table(means, 12, 6.0, 4))
    assert low < best <= high
    assert high - low > 0.2
    assert rankings.halves(table(means, 12, 0.01, 1)) == pytest.approx(1)


def test_from_how_many_scenes_on_a_difference_is_decided() -> None:
    scores = pd.DataFrame({"a": [1.0, 7.0, *14 * [1.0, 2.0]], "b": 4.0})
    said, count = rankings.decided(scores, "a", "b")
    assert said.startswith("-2.33 (")
    assert count is not None
    assert 20 < count <= 30
    assert rankings.decided(scores.assign(a=[3, 5] * 15), "a", "b")[1] is None
