"""The examples in docstrings are right: each module's are run, once."""

import doctest
import pkgutil
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import matbench

NAMES = sorted(found.name for found in pkgutil.walk_packages(matbench.__path__, "matbench."))


def _has_examples(name: str) -> bool:
    spec = find_spec(name)
    return spec is not None and spec.origin is not None and ">>> " in Path(spec.origin).read_text(encoding="utf-8")


WITH_EXAMPLES = [name for name in NAMES if _has_examples(name)]


def test_all_folders_are_looked_through() -> None:
    assert {name.split(".")[1] for name in WITH_EXAMPLES} >= {"datasets", "plans", "reports", "spec"}
    assert "matbench.algorithms.materiality.energy" in NAMES


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_are_right(name: str) -> None:
    found = doctest.testmod(import_module(name))
    assert found.attempted, f"{name} has examples, but none was found"
    assert not found.failed
