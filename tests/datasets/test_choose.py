"""Choosing views by their labels."""

import pytest

from matbench.datasets.choose import reference, view_indices
from matbench.errors import UserError

NINE = [str(k) for k in range(9)]
HALF = [str(k) for k in range(2, 7)]
COLS = [f"col{k}" for k in range(1, 6)]


@pytest.mark.parametrize(
    ("labels", "choice", "wanted"),
    [
        (NINE, None, "012345678"),
        (NINE, "0:9:2", "02468"),
        (NINE, "::2", "02468"),
        (NINE, "1::3", "147"),
        (NINE, ":4", "0123"),
        (NINE, ":", "012345678"),
        (NINE, "2:99", "2345678"),
        (NINE, "0+4+8", "048"),
        (NINE, "im2:im7:2", "246"),
        (NINE, "im2+6", "26"),
        (HALF, "0:9:2", "024"),
        (HALF, "::2", "024"),
        (HALF, "view3:6", "123"),
        (COLS, "col2:col6", "1234"),
        (COLS, "2:6", "1234"),
        (COLS, "col1+3+col5", "024"),
    ],
)
def test_views_are_chosen_by_number(labels: list[str], choice: str | None, wanted: str) -> None:
    assert "".join(map(str, view_indices("s", labels, choice, ["im", "view"]))) == wanted


@pytest.mark.parametrize(
    "choice",
    ["", "a:b", "1:2:3:4", "0:9:0", "0:9:-1", "-1:", "0:9:x", "x2:4", "99+100", "2+", "2+x", "3", "8:9", "5:2"],
)
def test_what_cannot_be_chosen_is_refused(choice: str) -> None:
    with pytest.raises(UserError) as caught:
        view_indices("some/scene", NINE, choice)
    message = str(caught.value)
    assert "\n" not in message
    assert "some/scene" in message
    assert "8" in message, "it lists what is possible"


def test_reference_is_the_fields_else_the_other_with_truth() -> None:
    assert reference("s", NINE, [2, 6], range(9), None) == 2
    assert reference("s", NINE, [2, 6], [4, 6, 8], None) == 6
    assert reference("s", NINE, [2, 6], range(9), "6") == 6


@pytest.mark.parametrize(
    ("chosen", "choice", "words"),
    [
        ([0, 4, 8], None, "none of the views 0, 4, 8"),
        (range(9), "4", "no ground truth"),
        ([4, 6], "2", "not among"),
        (range(9), "9", "unknown view"),
    ],
)
def test_no_truth_no_reference(chosen: list[int], choice: str | None, words: str) -> None:
    with pytest.raises(UserError, match=words) as caught:
        reference("some/scene", NINE, [2, 6], chosen, choice)
    assert "some/scene" in str(caught.value)
