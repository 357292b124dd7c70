"""Layer one, judged: more work, or less, is never an accident. `matbench bench --update` accepts it."""

import pytest
from subjects import METHODS
from work import counted, stored


def test_every_method_is_counted() -> None:
    assert sorted(stored()) == sorted(METHODS)
    assert all(stored().values())


@pytest.mark.parametrize("name", METHODS)
def test_work_is_what_it_was(name: str) -> None:
    assert counted(name) == stored()[name]
