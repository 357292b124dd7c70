"""The example of a network in torch, where torch is installed: what `matbench check` asks, and once a process."""

from pathlib import Path

import pandas as pd
import pytest
from shown import ROOT
from tools import need

import matbench
from matbench.plans.plan import methods
from matbench.plans.settings import Settings
from matbench.solving import method_check
from matbench.solving.check_scenes import Trial

SHARED = Settings(isolation="shared", threads=1)
EXAMPLE = ROOT / "docs/examples/torch_stereo.py"


@pytest.fixture(autouse=True)
def _needs() -> None:
    need("torch")


def test_the_example_keeps_to_what_is_asked_of_a_method(smaller: dict[str, Trial]) -> None:
    (method,) = methods(["torch_stereo"], [EXAMPLE])
    found = method_check.check(method, [EXAMPLE])
    assert {result.check: result.reason for result in found if result.verdict == "fail"} == {}


def test_the_network_is_loaded_once_by_a_shared_process(tmp_path: Path) -> None:
    scenes = [f"synthetic/{name}[size=64x48]" for name in ("box", "curved", "slanted")]
    matbench.compare("torch_stereo", scenes, plugin=EXAMPLE, out=tmp_path / "run", settings=SHARED)
    took = pd.read_csv(tmp_path / "run" / "cells.csv")["warmup_seconds"]
    assert took[1:].max() < took[0] / 4, "torch was imported again"
