"""What several methods share for their parameters."""

import pytest
from attrs import field, frozen

from matbench.algorithms.parameters import all_or_several, odd, planes_a_pixel, unread


@frozen
class Given:
    window: int = field(default=1, validator=odd)
    fineness: int = field(default=0, validator=planes_a_pixel)
    views: int = field(default=0, validator=all_or_several)


@pytest.mark.parametrize(
    ("name", "good", "bad", "said"),
    [
        ("window", [1, 3, 99], [0, 2, -1, 101], "it must be odd, 1 to 99"),
        ("fineness", [0, 1, 64], [-1, 65], r"it must be 0 \(automatic\) to 64"),
        ("views", [0, 2, 500], [1, -1], r"it must be 0 \(all\) or at least 2"),
    ],
)
def test_bounds_are_part_of_it_and_the_message_says_them(name, good, bad, said):
    assert [getattr(Given(**{name: value}), name) for value in good] == good
    for value in bad:
        with pytest.raises(ValueError, match=f"^{name} is {value}; {said}$"):
            Given(**{name: value})


def test_only_what_is_not_read_is_told():
    takes = {"sigma": (False, "similarity=ssd"), "alike": (True, "similarity=census")}
    assert unread(takes) == {"sigma": "similarity=ssd"}
