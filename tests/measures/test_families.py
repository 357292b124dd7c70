"""Families of metrics: which names they know, and what they say of the others."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from matbench.errors import UserError
from matbench.measures.benchmarks import BAD, QUANTILES, TOTAL_BAD
from matbench.measures.families import Family
from matbench.measures.metrics import bad_metric


@given(st.integers(1, 10**6))
def test_every_number_of_six_digits_names_the_metric_that_is_made_of_it(thousandths: int) -> None:
    number = thousandths / 1000
    for family in (BAD, TOTAL_BAD):
        name = family.name.replace("@", f"{number:g}")
        assert family.named(name).name == name


@pytest.mark.parametrize(("typed", "name"), [("bad_3.0", "bad_3"), ("bad_03", "bad_3"), ("bad_0.070", "bad_0.07")])
def test_a_number_has_one_spelling(typed: str, name: str) -> None:
    assert BAD.named(typed).name == name


@pytest.mark.parametrize(
    "name", ["bad", "bad_", "bad_x", "bad_-1", "bad_1e2", "bad_nan", "xbad_1", "bad_1 ", "bad_١", "avg"]
)
def test_other_names_are_none_of_the_family(name: str) -> None:
    assert BAD.named(name) is None
    assert QUANTILES.named(name) is None


@pytest.mark.parametrize("number", ["0", "0.0001", "1000.1", "999999999", "0.1234567"])
def test_numbers_that_are_not_possible_are_one_line(number: str) -> None:
    with pytest.raises(UserError, match=rf"metric bad_{number}: {number} is not a number from 0.001 to 1000"):
        BAD.named(f"bad_{number}")


def test_what_a_faulty_family_does_is_told() -> None:
    with pytest.raises(UserError, match=r"metric b_2: ZeroDivisionError: .*test_families.py"):
        Family("b_@", "", lambda number: 1 / 0, 1, 3).named("b_2")
    with pytest.raises(UserError, match="metric b_2: family b_@ made one called 'bad_2' for it"):
        Family("b_@", "", bad_metric, 1, 3).named("b_2")
    with pytest.raises(UserError, match="metric b_2: family b_@ made one called None for it"):
        Family("b_@", "", lambda number: None, 1, 3).named("b_2")
    for name in ("b", "b_@_@"):
        with pytest.raises(ValueError, match="@ must stand once in its name"):
            Family(name, "", bad_metric, 1, 3)
