"""Small comparisons, made and read."""

from pathlib import Path

import pandas as pd
from places import METHODS

import matbench
from matbench import comparison
from matbench.plans.record_option import RecordOption
from matbench.plans.settings import Settings

SMALL = "synthetic/box[size=96x72]"


def compare(tmp_path: Path, *algorithms: str, scene: str = SMALL, **options: object) -> pd.DataFrame:
    return matbench.compare(list(algorithms), scene, out=tmp_path / "run", plugin=[METHODS], **options)


def scored(
    tmp_path: Path,
    *algorithms: str,
    scene: str | list[str] = SMALL,
    plugin: Path | None = METHODS,
    seed: int | list[int] = 0,
    record: bool = False,
    volumes: bool = False,
) -> pd.DataFrame:
    """What `compare` gives, without the page that it draws: that takes ten times as long as the rest."""
    settings = Settings(record=RecordOption() if record else None, volumes=volumes)
    ready = comparison.prepare(
        list(algorithms), scene, out=tmp_path / "run", plugin=plugin or [], seed=seed, settings=settings
    )
    ready.run()
    return ready.tables().results


def cells(tmp_path: Path) -> pd.DataFrame:
    return pd.read_csv(tmp_path / "run" / "cells.csv", keep_default_na=False).set_index("algorithm")
