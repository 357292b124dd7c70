"""Numbers for drawing worlds: pinned, and distributed as they say."""

import numpy as np
import pytest

from matbench.datasets.synthetic.dice import Dice


def test_a_stream_is_pinned() -> None:
    """It must be the same with every version of NumPy: the worlds are drawn from it."""
    assert [Dice(0, 7).bits(), Dice(1, 7).bits(), Dice(0, 8).bits()] == PINNED
    dice = Dice(0, 7)
    assert [dice.bits() for _ in range(6000)][:1] == PINNED[:1], "more than one stock"
    assert len({dice.bits() for _ in range(6000)}) == 6000


PINNED = [224776240083897, 218574226484392, 233900983896465]


def test_numbers_are_distributed_as_they_say() -> None:
    dice = Dice(3)
    between = np.array([dice.between(-2, 4) for _ in range(4000)])
    assert (between.min() >= -2, between.max() < 4) == (True, True)
    assert between.mean() == pytest.approx(1, abs=0.15)
    logs = np.log([dice.log(0.01, 100) for _ in range(4000)])
    assert logs.mean() == pytest.approx(0, abs=0.25)
    assert logs.std() == pytest.approx(np.log(1e4) / np.sqrt(12), rel=0.05)
    wholes = [dice.whole(2, 4) for _ in range(600)]
    assert set(wholes) == {2, 3, 4}
    assert sum(dice.chance(0.2) for _ in range(4000)) == pytest.approx(800, abs=120)
    often = [dice.weighed({"a": 3, "b": 1, "never": 0}) for _ in range(4000)]
    assert often.count("a") == pytest.approx(3000, abs=130)
    assert set(often) == {"a", "b"}
    assert {dice.one("xyz") for _ in range(100)} == set("xyz")


def test_frames_are_upright() -> None:
    dice = Dice(4)
    for _ in range(50):
        frame = np.array(dice.frame(0.7))
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1)
    level = np.array([dice.frame(0.0) for _ in range(50)])
    np.testing.assert_allclose(level[:, 2], np.tile([0, 0, 1], (50, 1)), atol=1e-12)
