"""What a method says that it took of a device goes from its estimate to the tables and the page."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import matbench

PLUGIN = """
import numpy as np
from matbench import Context, Estimate, Scene


class Card:
    def __init__(self, seconds: float = 0.25, mb: float = 640.5, told: bool = True) -> None:
        self.seconds, self.mb, self.told = seconds, mb, told

    def solve(self, scene: Scene, context: Context) -> Estimate:
        maps = {scene.ref: np.zeros((scene.height, scene.width), np.float32)}
        if not self.told:
            return Estimate(maps)
        return Estimate(maps, device_seconds=np.float64(self.seconds) / (self.mb != 0), device_mb=self.mb)
"""


@pytest.fixture
def plugin(tmp_path: Path) -> Path:
    path = tmp_path / "card.py"
    path.write_text(PLUGIN)
    return path


def cells(tmp_path: Path, plugin: Path, *methods: str) -> pd.DataFrame:
    matbench.compare(list(methods), "synthetic/box[size=48x36]", plugin=plugin, out=tmp_path / "run")
    return pd.read_csv(tmp_path / "run" / "cells.csv")


def test_what_is_told_stands_in_tables_and_page(tmp_path: Path, plugin: Path) -> None:
    found = cells(tmp_path, plugin, "card", "card[told=false]")
    assert found["device_seconds"].tolist()[0] == 0.25
    assert found["device_mb"].tolist()[0] == 640.5
    assert found.loc[1, ["device_seconds", "device_mb"]].isna().all()
    assert found["seconds"].notna().all(), "the wall time is measured as ever"
    assert "device memory as told" in (tmp_path / "run" / "report.html").read_text()


@pytest.mark.parametrize("wrong", ["seconds=-1", "mb=-3", "mb=0"])
def test_what_no_device_takes_fails_the_cell_in_words(wrong: str, tmp_path: Path, plugin: Path) -> None:
    with np.errstate(all="ignore"):
        found = cells(tmp_path, plugin, f"card[{wrong}]")
    assert found["status"].tolist() == ["failed"]
    assert "which no device takes" in found["reason"][0]
