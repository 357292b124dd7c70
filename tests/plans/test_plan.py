"""Methods and scenes of a plan."""

from pathlib import Path

from matbench.plans.plan import methods


def test_a_method_in_two_spellings_is_one(tmp_path: Path) -> None:
    selectors = ["materiality[preset=paper]", "materiality[preset=paper passes=50]", "sgbm", "sgbm[fill=true]"]
    assert [str(method) for method in methods(selectors)] == ["materiality[preset=paper]", "sgbm"]
