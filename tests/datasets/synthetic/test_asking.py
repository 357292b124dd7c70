"""Options of synthetic scenes, read."""

import pytest

from matbench.datasets.synthetic import asking
from matbench.datasets.synthetic.asking import Asked
from matbench.datasets.synthetic.cameras import Strengths
from matbench.errors import UserError
from matbench.scene import Range


def test_options_are_read() -> None:
    assert asking.size("x", {}) == (240, 180)
    assert asking.size("x", {"size": "320x200"}) == (320, 200)
    assert asking.number("x", {"n": "7"}, "n", 5, 2, 25) == 7
    assert asking.number("x", {}, "n", 5, 2, 25) == 5
    given = asking.strengths("x", {"noise": "4", "gain": "0.25"}, Strengths(blur=2.0))
    assert given == Strengths(noise=4.0, gain=0.25, blur=2.0)
    with pytest.raises(UserError, match="unknown option 'sed' of x: did you mean 'seed'"):
        asking.check_options("x", ["sed"], asking.OPTIONS)
    with pytest.raises(UserError, match="n=1 of x: a whole number from 2 to 25"):
        asking.number("x", {"n": "1"}, "n", 5, 2, 25)


@pytest.mark.parametrize(
    ("n", "steps", "ref", "partner"),
    [(5, 2, 2, 2), (5, 2, 3, -2), (5, 3, 1, 3), (5, 3, 2, 2), (7, 4, 3, 3), (7, 4, 5, -4)],
)
def test_the_pair_fits_between_the_views(n: int, steps: int, ref: int, partner: int) -> None:
    asked = Asked("x", {}, n, 40, 30, 0, Strengths(), ref, steps, Range(0, 1), None)  # type: ignore[arg-type]
    assert asked.partner(ref) == partner
