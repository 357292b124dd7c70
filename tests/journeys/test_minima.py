"""Does the energy of the paper prefer the truth? The proof, run small (`tests/proofs/minima.py`)."""

from pathlib import Path

import pandas as pd
import pytest
from proofs import minima


def test_the_energy_prefers_a_vague_answer_to_the_truth_and_the_linear_one_less_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    energies = tmp_path / "energies.csv"
    asked = ["measure", str(energies), "-s", "synthetic/world[seed=3 n=5 size=96x72]", "--passes", "40"]
    minima.main(asked)
    rows = energies.read_text().splitlines()
    minima.main(asked)
    assert energies.read_text().splitlines() == rows, "nothing is measured twice"
    found = pd.read_csv(energies, names=minima.COLUMNS).set_index(["form", "map"])
    squares, linear = found.loc["squares"], found.loc["linear, tied more"]
    ends = [minima.FOUND, minima.LEFT]
    # the descent leaves the truth for a much lower energy and a worse map, and both starts end alike
    for form in (squares, linear):
        assert (form.loc[ends, "total"] < form.loc[minima.TRUTH, "total"]).all()
        assert (form.loc[ends, "all"] >= form.loc[minima.TRUTH, "all"]).all()
        assert form.loc[minima.LEFT, "total"] == pytest.approx(form.loc[minima.FOUND, "total"], rel=0.05)
    # by squares it is the data that prefer it; linear data are on the truth's side
    assert squares.loc[minima.FOUND, "data"] < squares.loc[minima.TRUTH, "data"] - 0.3
    assert linear.loc[minima.FOUND, "data"] > linear.loc[minima.TRUTH, "data"]
    assert linear.loc[minima.FOUND, "all"] < squares.loc[minima.FOUND, "all"]
    minima.main(["table", str(energies)])
    assert "| squares | truth |" in capsys.readouterr().out
