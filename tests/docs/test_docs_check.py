"""Whoever tries methods by the commands that the documentation shows is told that they pass."""

import pytest
from following import Desk, lines, shortened, words

from matbench.solving.check_scenes import Trial


@pytest.mark.parametrize("line", lines("check"), ids=str)
def test_methods_are_checked(line: str, desk: Desk, smaller: dict[str, Trial]) -> None:
    said = desk.follow(shortened(line))
    assert said.count(" passes\n") == len(words(line)) - 1
