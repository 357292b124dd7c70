"""Choosing views by their labels."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from matbench.datasets.choose import reference, search_range, view_indices, views_and_reference
from matbench.errors import UserError
from matbench.scene import NotInScene, Range

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


@pytest.mark.parametrize(
    ("labels", "preferred", "options", "wanted", "ref"),
    [
        (NINE, [2, 6], {}, "012345678", 2),
        # as wide as they fit
        (NINE, [2, 6], {"views": "2"}, "28", 2),
        (NINE, [2, 6], {"views": "3"}, "258", 2),
        (NINE, [2, 6], {"views": "5"}, "02468", 2),
        (NINE, [2, 6], {"views": "7"}, "0123456", 2),
        (NINE, [2, 6], {"views": "9"}, "012345678", 2),
        (COLS, [2], {"views": "3"}, "024", 2),
        (NINE, [2, 6], {"views": "3", "ref": "6"}, "036", 6),
        # as many as there are within the baseline
        (NINE, [2, 6], {"baseline": "1"}, "23", 2),
        (NINE, [2, 6], {"baseline": "2"}, "123", 2),
        (NINE, [2, 6], {"baseline": "4"}, "01234", 2),
        (NINE, [2, 6], {"baseline": "8"}, "012345678", 2),
        (COLS, [2], {"baseline": "2"}, "123", 2),
        # both
        (NINE, [2, 6], {"views": "2", "baseline": "4"}, "26", 2),
        (NINE, [2, 6], {"views": "3", "baseline": "4"}, "024", 2),
        (NINE, [2, 6], {"views": "3", "baseline": "6"}, "258", 2),
        (NINE, [2, 6], {"views": "5", "baseline": "4"}, "01234", 2),
        # labels as ever
        (NINE, [2, 6], {"views": "4:9:2"}, "468", 6),
        (NINE, [2, 6], {"views": "2+6"}, "26", 2),
    ],
)
def test_views_are_chosen_by_count_and_baseline(
    labels: list[str], preferred: list[int], options: dict[str, str], wanted: str, ref: int
) -> None:
    chosen, found = views_and_reference("s", labels, preferred, options)
    assert ("".join(map(str, chosen)), found) == (wanted, ref)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"views": "10"}, "views=10 of some/scene: it has 9 views, 2 to 9 is possible"),
        ({"views": "1"}, "2 to 9 is possible"),
        ({"views": "0"}, "2 to 9 is possible"),
        ({"baseline": "9"}, "baseline=9 of some/scene: it has 9 views, 1 to 8 is possible"),
        ({"baseline": "0"}, "1 to 8 is possible"),
        ({"views": "3", "baseline": "5"}, "3 evenly spaced views, 2 among them, a baseline of 2, 4, 6 is possible"),
        ({"views": "9", "baseline": "4"}, "a baseline of 8 is possible"),
        ({"views": "12", "baseline": "4"}, "2 to 9 is possible"),
    ],
)
def test_what_a_scene_has_not_is_told_from_what_nobody_can_read(options: dict[str, str], words: str) -> None:
    with pytest.raises(NotInScene, match=words):
        views_and_reference("some/scene", NINE, [2, 6], options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"baseline": "x"}, "whole number of view steps"),
        ({"baseline": "-1"}, "whole number of view steps"),
        ({"baseline": "4", "views": "0:9:2"}, "goes with a number of views"),
        ({"baseline": "4", "views": ""}, "goes with a number of views"),
        ({"views": "9999999"}, "unknown view"),
        ({"views": "3", "ref": "4"}, "no ground truth"),
    ],
)
def test_numbers_that_nobody_can_read_are_refused_everywhere(options: dict[str, str], words: str) -> None:
    with pytest.raises(UserError, match=words) as caught:
        views_and_reference("some/scene", NINE, [2, 6], options)
    assert not isinstance(caught.value, NotInScene)


def test_the_range_to_search_is_given_in_pixels_of_the_pair() -> None:
    assert search_range("s", None, 4) is None
    assert search_range("s", "0:21", 1) == Range(0, 21)
    assert search_range("s", "-7.5:10", 2.5) == Range(-3, 4)


@pytest.mark.parametrize("text", ["", "21", "21:0", "0:0", "0:1e9", "0:99999", "a:b", "0:1:2", "nan:3", "0;3"])
def test_ranges_that_cannot_be_are_refused(text: str) -> None:
    with pytest.raises(UserError, match="LEAST:LARGEST in pixels of the pair"):
        search_range("s", text, 1)


_TYPED = st.text(alphabet="0123456789:+-.xcol ", max_size=8) | st.text(max_size=6)


@given(st.dictionaries(st.sampled_from(["views", "baseline", "ref"]), _TYPED), _TYPED)
def test_whatever_is_typed_is_a_choice_or_the_users_error(options: dict[str, str], text: str) -> None:
    with suppress(UserError):
        chosen, ref = views_and_reference("s", NINE, [2, 6], options)
        assert ref in chosen
        assert len(chosen) >= 2
    with suppress(UserError):
        found = search_range("s", text, 4)
        assert found is not None
        assert found.least < found.largest
