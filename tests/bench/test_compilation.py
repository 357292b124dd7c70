"""Compilation: in a fresh process, with no kernel cached."""

import sys
from pathlib import Path

import pytest

from matbench.bench.compilation import Compilation, compile_all
from matbench.bench.measuring import BENCHMARKS, Tree
from matbench.errors import UserError


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    (tmp_path / BENCHMARKS).mkdir(parents=True)
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "winner.nbc").touch()
    return Tree(tmp_path, Path(sys.executable), tmp_path / "kernels")


def test_the_ratio_is_that_of_all_methods_together() -> None:
    assert Compilation({"a": 1.0, "b": 2.0}, 0.5, "digest").ratio == 6


def test_no_kernel_is_cached_and_none_is_kept(tree: Tree) -> None:
    (tree.code / BENCHMARKS / "compiling.py").write_text(
        "import json, os\nfrom pathlib import Path\nplace = Path(os.environ['NUMBA_CACHE_DIR'])\n"
        "cached = len(list(place.iterdir()))\n(place / 'mine.nbc').touch()\n"
        "print(json.dumps({'seconds': {'a': 3.0, 'cached': cached}, 'reference': 1.5, 'digest': str(place)}))\n"
    )
    found = compile_all(tree)
    assert found.seconds == {"a": 3.0, "cached": 0}
    assert found.ratio == 2
    assert not Path(found.digest).exists()
    assert [path.name for path in tree.kernels.iterdir()] == ["winner.nbc"]


def test_a_method_that_cannot_be_compiled_is_told(tree: Tree) -> None:
    (tree.code / BENCHMARKS / "compiling.py").write_text("raise TypeError('no such kernel')\n")
    with pytest.raises(UserError, match=r"compiling\.py failed: TypeError: no such kernel"):
        compile_all(tree)
