"""What is imported from `matbench`: all of it is there, quickly, and old names go on working."""

import subprocess
import sys

import pytest

import matbench


def test_every_name_is_there_and_what_plug_ins_need_among_them() -> None:
    assert all(getattr(matbench, name) is not None for name in matbench.__all__)
    needed = "Algorithm Context Estimate Volume Metric MapInRegion VolumeMetric Rays PredictionMetric Dataset Listing"
    assert {*needed.split(), "Scene", "Range", "Download", "Remote", "UserError"} <= set(matbench.__all__)
    with pytest.raises(AttributeError, match="no attribute 'Metrics'"):
        matbench.Metrics  # noqa: B018 -- that is what is tried


def test_importing_it_imports_nothing_else() -> None:
    line = "import sys, matbench; print(*sorted(name for name in sys.modules if name.split('.')[0] in sys.argv[1:]))"
    names = ["matbench", "numpy", "attrs", "attr", "importlib.metadata"]
    done = subprocess.run([sys.executable, "-c", line, *names], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["matbench", "matbench._moved", "matbench._version"]
