"""The price of a change of plane, pixel by pixel."""

import numpy as np
import pytest

from matbench.algorithms.smoothness import Smoothness


def test_prices_are_lower_across_edges() -> None:
    image = np.zeros((2, 3, 3), np.uint8)
    image[0, 2, 1] = 8  # one colour is enough
    image[1, 2, 0] = 7
    down, right = Smoothness(smoothness=5, flat=3, edge=8).weights(image, 99)
    np.testing.assert_array_equal(down, [[15, 15, 5]])
    np.testing.assert_array_equal(right, [[15, 5], [15, 15]])
    assert down.dtype == right.dtype == np.float32


def test_zero_is_the_methods_own_choice() -> None:
    down, right = Smoothness(flat=2).weights(np.zeros((2, 2, 3), np.uint8), 0.25)
    assert set(down.ravel()) == set(right.ravel()) == {0.5}


def test_what_is_not_read_is_said() -> None:
    assert set(Smoothness(flat=1).silent) == {"edge"}
    assert set(Smoothness(edge=0).silent) == {"flat"}
    assert not Smoothness().silent


@pytest.mark.parametrize("wrong", [{"smoothness": -1}, {"flat": -0.5}, {"edge": -1}])
def test_wrong_parameters(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Smoothness(**wrong)
