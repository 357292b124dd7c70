"""Of which kinds the scenes of a mean are."""

import pytest

from matbench.reports.mixture import mixture


@pytest.mark.parametrize(
    ("scenes", "told"),
    [
        ([], ""),
        (["synthetic/world-1"], ""),
        (["synthetic/world-1", "synthetic/world-2[noise=4]"], ""),
        (["synthetic/box", "synthetic/thin"], ""),
        (["synthetic/world-1", "synthetic/world-thin-1"], "synthetic/world 1, synthetic/world-thin 1"),
        (["synthetic/world-1", "middlebury2003/teddy", "synthetic/world-9"], "synthetic 2, middlebury2003 1"),
    ],
)
def test_kinds_are_told_where_there_are_several(scenes: list[str], told: str) -> None:
    assert mixture(scenes) == told
