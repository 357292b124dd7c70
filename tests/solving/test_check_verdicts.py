"""Verdicts on the answers of a method."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
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


@pytest.mark.parametrize(
    ("taken", "said"),
    [
        (lambda truth, pair: truth, ""),
        (lambda truth, pair: truth[::-1], "upside down"),
        (lambda truth, pair: truth[::-1, ::-1], "turned by half"),
        (lambda truth, pair: -truth, "of the other sign"),
        (lambda truth, pair: truth * pair, "in pixels of the pair: divide them by 2"),
        (lambda truth, pair: truth * 16, "16 times too large"),
        (lambda truth, pair: truth / 256, "256 times too small"),
        (lambda truth, pair: np.full_like(truth, np.nanmedian(truth)), ""),
        (lambda truth, pair: np.full_like(truth, np.nan), ""),
        (lambda truth, pair: np.random.default_rng(0).random(truth.shape, np.float32) * 5, ""),
    ],
)
def test_maps_that_would_be_right_if_they_were_taken_otherwise(
    taken: Callable[[NDArray[np.float32], float], NDArray[np.float32]], said: str
) -> None:
    answers = {
        name: check_solve.Answer({scene.ref: taken(scene.truth[scene.ref], scene.pair_steps)})
        for name, scene in check_scenes.truths().items()
    }
    found = check_verdicts._sense(answers)
    assert (found.verdict, said in found.reason) == ("fail" if said else "pass", True)
