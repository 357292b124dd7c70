"""Verdicts on the answers of a method."""

from pathlib import Path

import pytest
from subjects import METHODS as BUILT_IN

from matbench.plans.plan import methods
from matbench.solving import check_scenes, check_solve, check_verdicts
from matbench.solving.check_verdicts import CheckResult


def verdicts(found: list[CheckResult]) -> dict[str, str]:
    return {finding.check: finding.verdict for finding in found}


@pytest.mark.parametrize("selector", BUILT_IN)
def test_built_in_methods_keep_to_it(selector: str, smaller: dict[str, check_scenes.Trial], tmp_path: Path) -> None:
    (method,) = methods(selector)
    answers = {name: check_solve.solve_here(method, (), trial, tmp_path / "log") for name, trial in smaller.items()}
    found = check_verdicts.judge(answers)
    assert set(verdicts(found).values()) == {"pass"}, found
