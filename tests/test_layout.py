"""Tests mirror the packages: those of ``matbench/runs/store.py`` are found in ``tests/runs/test_store.py``.

A module with many tests may have further files beside that one, ``test_store_<part>.py``.
"""

from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import pytest
from places import ROOT, TESTS

FOLDERS = ("matbench", "algorithms", "datasets", "reports")
WITHOUT = {"__init__", "__main__", "_version"}
"""Modules that only gather names, start the command line, or hold a number."""
ELSEWHERE = {
    "journeys": "whole stories through several modules",
    "docs": "what the documentation shows is run",
    "benchmarks": "what `matbench bench` runs",
}
"""Folders of tests that belong to no single module -> why."""
OWN = {
    "test_layout.py": "of the tests themselves",
    "test_package.py": "of matbench/__init__.py: its public names",
    "test_skips.py": "of the tests themselves: what they skip",
}
"""Files at the top that belong to no module -> why."""


def modules(root: Path) -> Iterator[PurePosixPath]:
    """Every module as its tests are laid out: ``runs/store`` for ``matbench/runs/store.py``."""
    for folder in FOLDERS:
        for path in (root / folder).rglob("*.py"):  # it follows no links, so that no module comes twice
            if path.stem not in WITHOUT:
                inside = path.relative_to(root / "matbench" if folder == "matbench" else root)
                yield PurePosixPath(inside.with_suffix("").as_posix())


def files_of(tests: Path) -> Iterator[PurePosixPath]:
    for path in tests.rglob("test_*.py"):
        inside = PurePosixPath(path.relative_to(tests).as_posix())
        if inside.parts[0] not in ELSEWHERE and str(inside) not in OWN:
            yield inside


def faults(root: Path, tests: Path) -> list[str]:
    """What is not where it should be, a sentence each."""
    known, files = sorted(modules(root)), sorted(files_of(tests))
    wanted = {one: one.with_name(f"test_{one.name}.py") for one in known}
    found = [f"{one}.py has no tests: write tests/{file}" for one, file in wanted.items() if file not in files]
    for file in files:
        names = [one.name for one in known if one.parent == file.parent]
        stem = file.stem.removeprefix("test_")
        if not any(stem == name or stem.startswith(f"{name}_") for name in names):
            found.append(
                f"tests/{file} is named after no module: call it after the one that it tests, "
                f"or put it into tests/journeys/ if it tests several"
            )
    return found


def test_each_module_has_its_tests_and_each_test_its_module() -> None:
    found = faults(ROOT, TESTS)
    assert not found, "\n".join(found)


@pytest.mark.parametrize("name", ELSEWHERE)
def test_no_exception_is_left_over(name: str) -> None:
    assert list((TESTS / name).glob("test_*.py")), f"tests/{name} has no tests: take it out of ELSEWHERE"
    assert all((TESTS / file).is_file() for file in OWN)


def test_what_is_in_the_wrong_place_is_told(tmp_path: Path) -> None:
    for name in (
        "matbench/__init__.py",
        "matbench/scene.py",
        "matbench/runs/store.py",
        "reports/page.py",
        "tests/test_scene.py",
        "tests/runs/test_page.py",
        "tests/runs/test_store_killed.py",
        "tests/reports/test_page.py",
        "tests/journeys/test_anything.py",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "matbench" / "reports").symlink_to(tmp_path / "reports")
    assert faults(tmp_path, tmp_path / "tests") == [
        "runs/store.py has no tests: write tests/runs/test_store.py",
        "tests/runs/test_page.py is named after no module: call it after the one that it tests, "
        "or put it into tests/journeys/ if it tests several",
    ]
