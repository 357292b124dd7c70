"""Colours of maps."""

import numpy as np
from attrs import evolve

from matbench.recording.coloring import UNKNOWN, disparity_ends, error_colors, palette, truth_colors
from matbench.scene import Range, Scene


def test_no_answer_and_unknown_truth_differ_from_every_colour() -> None:
    truth = np.array([[1, 2, np.nan, 1]], np.float32).repeat(8, axis=0)
    answer = np.array([[1, np.nan, 2, 9]], np.float32).repeat(8, axis=0)
    picture = error_colors(answer, truth, 2.0)
    assert (picture[:, 0] == palette("magma")[0]).all()
    assert (picture[:, 3] == palette("magma")[255]).all()
    assert (picture[:, 2] == UNKNOWN).all()
    assert set(map(tuple, picture[:, 1].tolist())) == {(196, 196, 196), (250, 250, 250)}
    for name in ("viridis", "magma"):
        assert not {(v, v, v) for v in (UNKNOWN, 196, 250)} & set(map(tuple, palette(name).tolist()))


def test_one_scale_for_a_scene() -> None:
    truth = np.array([[1, 4, np.nan]], np.float32)
    scene = Scene("a", np.zeros((2, 1, 3, 3), np.uint8), ("0", "1"), 0, Range(0, 9), {0: truth}, 1)
    assert disparity_ends(scene) == (1, 4)
    assert disparity_ends(evolve(scene, truth={})) == (0, 9)
    assert disparity_ends(evolve(scene, truth={0: np.full((1, 3), 3, np.float32)})) == (2.5, 3.5)


def test_the_ends_of_a_scale_have_the_ends_of_the_colours() -> None:
    picture = truth_colors(np.array([[1, 4, np.nan, 9]], np.float32), (1, 4), levels=16)
    assert (picture[0, 0] == palette("viridis")[0]).all()
    assert (picture[0, 1] == palette("viridis")[255]).all()
    assert (picture[0, 3] == palette("viridis")[255]).all()
    assert (picture[0, 2] == UNKNOWN).all()
