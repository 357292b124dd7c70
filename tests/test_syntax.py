"""What a Python source does and imports."""

import ast
from textwrap import dedent

import pytest

from matbench.syntax import Import, drop_words, facts


def of(source: str, is_package: bool = False):
    return facts(dedent(source).encode(), is_package)


@pytest.mark.parametrize(
    ("other", "is_same"),
    [
        ("def f(x):\n    '''Twice.'''\n    return 2 * x  # as it says\n", True),
        ("def f(x):\n    pass\n    return (2 * x)\n", True),
        ("def f(x):\n    return x * 2\n", False),
        ("def f(y):\n    return 2 * y\n", False),
        ("def f(x):\n    return 2.0 * x\n", False),
        ("def f(x):\n    return '2' * x\n", False),
    ],
)
def test_what_is_done_counts_and_how_it_is_written_does_not(other: str, is_same: bool) -> None:
    assert (of("def f(x):\n    return 2 * x\n").digest == of(other).digest) == is_same


def test_imports_are_found_wherever_they_stand() -> None:
    found = of(
        """
        import a.b
        import numpy as np
        from ..up import one as two
        from . import beside
        from typing import TYPE_CHECKING
        if TYPE_CHECKING:
            from never import Seen
        def late():
            from inside import *
            import_module("far.away")
            import_module("." + name)
            __import__("..near")
            return np.linalg.norm(two.three)
        """
    ).imports
    assert set(found) == {
        Import(0, "a.b"),
        Import(0, "numpy"),
        Import(2, "up", "one"),
        Import(1, "", "beside"),
        Import(0, "typing", "TYPE_CHECKING"),
        Import(0, "inside", "*"),
        Import(0, "far.away"),
        Import(2, "near"),
        Import(0, "numpy", "linalg", is_attribute=True),
        Import(0, "numpy.linalg", "norm", is_attribute=True),
        Import(2, "up.one", "three", is_attribute=True),
    }
    assert len(found) == len(set(found)), "each once"


def test_only_packages_tell_their_names_those_for_checkers_too() -> None:
    source = """
        from typing import TYPE_CHECKING
        if TYPE_CHECKING:
            from .inner import Thing as Other
        """
    assert of(source).names == {}
    assert of(source, is_package=True).names == {
        "TYPE_CHECKING": Import(0, "typing", "TYPE_CHECKING"),
        "Other": Import(1, "inner", "Thing"),
    }


@pytest.mark.parametrize("source", [b"def f(:", b"\0", b"\xff\xfe", b"(" * 5000])
def test_what_is_no_python_is_known_by_its_bytes(source: bytes) -> None:
    found = facts(source, False)
    assert found.imports == ()
    assert found.digest != facts(source + b" ", False).digest
    assert len(found.digest) == 64


def test_words_that_do_nothing_are_taken_out_everywhere() -> None:
    tree = ast.parse(
        dedent(
            """
            '''A module.'''
            class C:
                '''A class.'''
                def f(self):
                    '''A function.'''
                    if TYPE_CHECKING:
                        import never
                    else:
                        return 1
                    for x in y:
                        'a lone text'
                        pass
                        x()
            """
        )
    )
    drop_words(tree)
    left = ast.unparse(tree)
    assert "'" not in left
    assert "never" not in left
    assert "pass" not in left
    assert "return 1" in left
    assert "x()" in left
