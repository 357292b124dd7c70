"""Solves of a method that is checked."""

from pathlib import Path

from needles import SEARCHING, looking_for

from matbench import load_scene
from matbench.plans.plan import methods
from matbench.solving.check_scenes import EASY, trials
from matbench.solving.check_solve import solve_apart


def test_no_truth_is_within_reach_of_a_method_that_is_checked(tmp_path: Path) -> None:
    (method,) = methods(looking_for(tmp_path, load_scene(EASY)), [SEARCHING])
    answer = solve_apart(method, [SEARCHING], trials()["easy"], timeout=120)
    assert not answer.error
    assert {float(values.max()) for values in answer.maps.values()} == {0.0}
