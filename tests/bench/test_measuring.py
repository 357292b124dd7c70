"""Processes that measure: their environment, what they may be asked for, and what is told when they fail."""

import sys
from pathlib import Path

import pytest
from places import ROOT
from subjects import KERNELS, METHODS

from matbench.bench import measuring
from matbench.bench.measuring import BENCHMARKS, Tree
from matbench.errors import UserError

HERE = Tree(ROOT, Path(sys.executable), Path("/kernels"))


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    """A checkout without anything yet."""
    (tmp_path / BENCHMARKS).mkdir(parents=True)
    return Tree(tmp_path, Path(sys.executable), tmp_path / "kernels")


def test_the_checkout_that_is_measured_is_this_one() -> None:
    assert Tree.here().code == ROOT
    assert Tree.here().python == Path(sys.executable)


def test_a_process_that_measures_has_one_thread_and_no_outer_pytest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTEST_XDIST_WORKER", "gw0")
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.setenv("MINE", "kept")
    found = measuring.environment(HERE)
    assert not [name for name in found if name.startswith("PYTEST_")]
    assert (found["OMP_NUM_THREADS"], found["NUMBA_NUM_THREADS"], found["MINE"]) == ("1", "1", "kept")
    assert found["NUMBA_CACHE_DIR"] == "/kernels"


def test_subjects_are_chosen_by_names_and_patterns() -> None:
    assert measuring.subjects(HERE) == [*METHODS, *KERNELS]
    assert measuring.subjects(HERE, ["winner", "sgb*", "sgbm"]) == ["winner", "sgbm"]
    with pytest.raises(UserError, match="unknown subject 'winer': did you mean 'winner'"):
        measuring.subjects(HERE, ["winer"])


def test_a_programs_last_line_counts(tree: Tree) -> None:
    (tree.code / BENCHMARKS / "beside.py").write_text("ANSWER = 42\n")
    (tree.code / BENCHMARKS / "asked.py").write_text(
        "import json, os\nfrom beside import ANSWER\nprint('a library speaks')\n"
        "print(json.dumps([ANSWER, __name__, os.environ['NUMBA_CACHE_DIR'], os.getcwd()]))\n"
    )
    found = measuring.run_program(tree, "asked")
    assert found == [42, "__main__", str(tree.kernels), str(tree.code)]


def test_a_program_that_fails_is_told_by_its_last_line(tree: Tree) -> None:
    (tree.code / BENCHMARKS / "asked.py").write_text("raise ValueError('no scene')\n")
    with pytest.raises(UserError, match=r"asked\.py failed: ValueError: no scene"):
        measuring.run_program(tree, "asked")
    (tree.code / BENCHMARKS / "asked.py").write_text("import os\nos._exit(7)\n")
    with pytest.raises(UserError, match=r"asked\.py failed: exit status 7"):
        measuring.run_program(tree, "asked")


def test_where_nothing_is_measured_it_says_so(tree: Tree) -> None:
    with pytest.raises(UserError, match="nothing was measured in") as error:
        measuring.sit(tree, ["sgbm"])
    assert "\n" not in str(error.value)
