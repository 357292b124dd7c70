"""Surfaces as rows of numbers: their boxes hold them, their windows hold the rays that meet them."""

import numpy as np
import pytest
from odd_solids import KINDS, SKIN, hit, solid

from matbench.datasets.synthetic import solids
from matbench.datasets.synthetic.dice import Dice
from matbench.datasets.synthetic.solids import Model, Skin, flat, round_


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_ray_meets_lies_in_box_and_window(kind: int) -> None:
    dice, hits = Dice(kind), 0
    for _ in range(20):
        one = solid(kind, dice)
        model = Model.of([one])
        low, high = np.array(one.box).reshape(3, 2).T
        for eye in (-0.3, 0.0, 0.2):
            left, right, top, bottom, near = model.windows(eye)[0]
            for _ in range(60):
                across, down = dice.between(-0.5, 0.5), dice.between(-0.5, 0.5)
                z = hit(one.kind, model.rows[0], eye, across, down)
                if np.isfinite(z):
                    hits += 1
                    point = np.array([eye + z * across, z * down, z])
                    assert (point >= low - 1e-9).all()
                    assert (point <= high + 1e-9).all()
                    assert (left - 1e-9 <= across <= right + 1e-9, top - 1e-9 <= down <= bottom + 1e-9) == (True, True)
                    assert near <= z + 1e-9
    assert hits > 60


def test_the_nearest_comes_first_and_what_is_close_may_be_anywhere() -> None:
    wall = flat(solids.PLANE, (0, 0, 5), (1, 0, 0), (0, 1, 0), SKIN)
    far, near = (round_(solids.BALL, (0, 0, z), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), SKIN) for z in (4, 3))
    model = Model.of([far, near, wall])
    assert model.kinds.tolist() == [solids.PLANE, solids.BALL, solids.BALL]
    assert model.boxes[1:, 4].tolist() == [2, 3]
    assert model.windows(0.0)[0, :4].tolist() == [-np.inf, np.inf, -np.inf, np.inf]


def test_a_skin_is_a_row() -> None:
    skin = Skin(2, 4.0, (0.1, 0.2), (0.6, 0.8), (1.0, 2.0, 3.0), 5.0, 0.5, 6.0, 7.0, 8.0, 2)
    assert skin.row() == pytest.approx([2, 0.15, 0.2, 0.1, 0.2, 1, 2, 3, 5, 0.5, 6, 7, 8, 2])
