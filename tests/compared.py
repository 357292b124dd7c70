"""Small comparisons, made and read."""

from pathlib import Path

import pandas as pd
from places import METHODS

import matbench

SMALL = "synthetic/box[size=96x72]"


def compare(tmp_path: Path, *algorithms: str, scene: str = SMALL, **options: object) -> pd.DataFrame:
    return matbench.compare(list(algorithms), scene, out=tmp_path / "run", plugin=[METHODS], **options)


def cells(tmp_path: Path) -> pd.DataFrame:
    return pd.read_csv(tmp_path / "run" / "cells.csv", keep_default_na=False).set_index("algorithm")
