"""Worlds are drawn from what the documentation says."""

from functools import cache

import numpy as np
import pytest

from matbench.datasets.synthetic import random_worlds, solids
from matbench.datasets.synthetic.appearance import appearance

SEEDS = range(50)

draw = cache(random_worlds.draw)


def test_a_seed_is_a_world_and_another_one_another() -> None:
    one, again, other, thin = (random_worlds.draw(*asked) for asked in ((7,), (7,), (8,), (7, "thin")))
    assert one.solids == again.solids
    assert (one.light, one.strengths) == (again.light, again.strengths)
    assert other.solids != one.solids != thin.solids
    assert other.near != one.near
    assert other.strengths != one.strengths


def test_cameras_and_disturbances_vary_within_what_is_documented() -> None:
    found = [draw(seed) for seed in SEEDS]
    near = np.array([one.near for one in found])
    assert (near.min() >= 0.04, near.max() <= 0.16, near.max() > 2.5 * near.min()) == (True, True, True)
    assert {one.views for one in found} == {5, 7, 9}
    assert all(0 <= one.ref < one.ref + one.steps < one.views for one in found)
    assert all(1.1 < one.largest / one.near < 1.4 for one in found)
    for name in ("noise", "blur"):
        drawn, measured = [getattr(one.strengths, name) for one in found], getattr(appearance(), name)
        assert 0.8 * min(measured) <= min(drawn) <= max(drawn) <= 1.25 * max(measured)
        assert np.median(drawn) == pytest.approx(np.median(measured), rel=0.4)
    gains = [one.strengths.gain for one in found]
    assert 0 < np.count_nonzero(gains) < len(found) / 2
    assert all(np.linalg.norm(one.light[:3]) == pytest.approx(1) for one in found)


def test_every_kind_of_surface_occurs() -> None:
    kinds = {one.kind for seed in SEEDS for one in draw(seed).solids}
    assert kinds == {*range(solids.PLANE + 1), solids.BALL, solids.HOLLOW, solids.TUBE, solids.CONE}
