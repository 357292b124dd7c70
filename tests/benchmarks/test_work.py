"""Layer one, judged: more work, or less, is never an accident. `matbench bench --update` accepts it."""

import pytest
from subjects import METHODS
from work import counted, stored

UPDATE = "type matbench bench --update, and commit what it writes"


def test_every_method_is_counted() -> None:
    missing, gone = METHODS.keys() - stored().keys(), stored().keys() - METHODS.keys()
    assert not missing | gone, f"{sorted(missing)} have no stored counters, {sorted(gone)} are no methods: {UPDATE}"
    assert all(stored().values())


@pytest.mark.parametrize("name", METHODS)
def test_work_is_what_it_was(name: str) -> None:
    assert name in stored(), f"no counters of {name} are stored: {UPDATE}"
    assert counted(name) == stored()[name], f"if that is meant: {UPDATE}"
