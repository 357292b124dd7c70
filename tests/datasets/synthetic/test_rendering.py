"""Exact geometry, visibility and highlights of what is computed."""

import numpy as np
import pytest
from rigs import PAINT, rig_of, wall

from matbench.datasets.synthetic.rendering import Rig, mirrored
from matbench.datasets.synthetic.surfaces import LIGHT, Paint, Rectangle
from matbench.datasets.synthetic.textures import pattern


def test_a_wall_has_the_disparity_of_its_depth() -> None:
    assert rig_of(wall(3.0)).truth(0) == pytest.approx(60 * 0.1 / 3)
    assert rig_of(wall(3.0), offset=2.5).truth(2) == pytest.approx(60 * 0.1 / 3 - 2.5)


def test_a_slanted_plane_has_linear_disparity() -> None:
    truth = rig_of(Rectangle((-5, -5, 2.0), (10, 0, 4.0), (0, 10, 0), PAINT)).truth(1)
    assert np.isfinite(truth).all()
    assert np.abs(np.diff(truth, axis=1) - (truth[0, 1] - truth[0, 0])).max() < 1e-12
    assert np.abs(np.diff(truth, axis=0)).max() < 1e-12
    # on the middle ray X = 0: depth 2 + 4 / 2
    assert truth[20, 30] == pytest.approx(60 * 0.1 / 4)


def test_visibility_of_a_screen_before_a_wall() -> None:
    screen = Rectangle((-0.21, -9, 1.5), (0.42, 0, 0), (0, 18, 0), PAINT)
    rig = rig_of(wall(3.0), screen)
    truth, seen = rig.truth(1), rig.visible(1)
    assert sorted(set(truth[20].round(9))) == [2, 4]
    on_screen = np.flatnonzero(truth[20] > 3)
    assert on_screen.tolist() == list(range(22, 39))  # |x - 30| <= 60 * 0.21 / 1.5 = 8.4
    # the screen moves 4 and the wall 2 px to the left in view 2: the two columns on its left are hidden
    assert np.flatnonzero(~seen[2][20]).tolist() == [0, 1, 20, 21]
    assert np.flatnonzero(~seen[0][20]).tolist() == [39, 40, 59, 60]
    assert seen[1].all()


def test_highlights_move_with_the_camera_and_nothing_else_does() -> None:
    """On a wall without texture the only thing to be seen is the highlight: it stays where it is in every view."""
    wall = Rectangle((-8, -8, 7.6), (16, 0, -4.7), (0, 16, -4.6), Paint((60, 60, 60), 0, 1.0))
    dull, shiny = (Rig([wall], 3, 61, 41, 60, 0.1, highlight=grey) for grey in (0, 100))
    marks = pattern(0)
    assert np.ptp(dull.picture(0, marks)) < 1e-3
    peaks = [np.unravel_index(shiny.picture(view, marks)[..., 0].argmax(), (41, 61)) for view in range(3)]
    assert len(set(peaks)) == 1, "the light is infinitely far"
    assert shiny.picture(1, marks).max() == pytest.approx(dull.picture(1, marks).max() + 100, abs=2)
    assert wall.depth(0.0, np.zeros((1, 1)), np.zeros((1, 1))).item() == pytest.approx(2.95)


def test_a_mirror_towards_the_light_is_as_bright_as_it_can_be() -> None:
    here = (np.zeros(1), np.zeros(1), np.ones(1))  # a normal (0, 0, 1), the eye along it
    assert mirrored(LIGHT, tuple(np.array([c]) for c in LIGHT)) == pytest.approx(1)
    half = np.array(LIGHT) / 2 + (0, 0, 0.5)
    assert mirrored((0, 0, 1), here) == pytest.approx((half[2] / np.linalg.norm(half)) ** 32)
