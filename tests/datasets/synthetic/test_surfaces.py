"""Surfaces are where they should be, and their windows leave nothing out."""

import numpy as np
import pytest
from rigs import PAINT, rig_of, wall

from matbench.datasets.synthetic import WORLDS
from matbench.datasets.synthetic.rendering import Rig
from matbench.datasets.synthetic.surfaces import EVERYWHERE, Column, Disc, Rectangle, Sphere


def test_round_surfaces_are_where_they_should_be() -> None:
    ball = rig_of(wall(9.0), Sphere((0.0, 0.0, 3.0), 1.0, PAINT))
    column = rig_of(wall(9.0), Column(0.0, 3.0, 1.0, PAINT))
    for rig in (ball, column):
        assert rig.truth(1)[20, 30] == pytest.approx(60 * 0.1 / 2), "its front is at depth 2"
    # tangents have a slope of 1 / sqrt(8)
    edge = 60 / 8**0.5
    assert (ball.cast(1, np.arange(61.0)[None], np.array([[20.0]]))[1][0] == 1).sum() == 2 * int(edge) + 1
    assert (column.truth(1)[0] == column.truth(1)[20]).all()


@pytest.mark.parametrize("name", sorted(WORLDS))
def test_windows_leave_nothing_out(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The slow twin tries every ray on every surface."""
    rig = Rig(WORLDS[name].build(), 5, 60, 45, 60, 1 / 40, WORLDS[name].offset / 4)
    rows = np.arange(45.0)[:, None]
    places = np.random.default_rng(0).uniform(-3, 62, (45, 60))
    quick = [rig.cast(view, columns, rows) for view in (0, 3) for columns in (np.arange(60.0)[None], places)]
    for kind in (Rectangle, Disc, Sphere, Column):
        monkeypatch.setattr(kind, "window", lambda self, eye: EVERYWHERE)
    slow = [rig.cast(view, columns, rows) for view in (0, 3) for columns in (np.arange(60.0)[None], places)]
    for (depth, index), (expected, which) in zip(quick, slow, strict=True):
        np.testing.assert_array_equal(depth, expected)
        np.testing.assert_array_equal(index, which)
