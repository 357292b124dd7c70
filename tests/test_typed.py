"""Values as they are typed: what is read again is the same."""

import pytest

from matbench.spec import parse
from matbench.typed import Value, typed


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (True, "true"),
        (None, "none"),
        (3, "3"),
        (0.5, "0.5"),
        ("all", "all"),
        ("two words", "'two words'"),
        ("a,b", "'a,b'"),
        ("it's", '"it\'s"'),
    ],
)
def test_a_value_is_typed_so_that_it_is_read_again(value: Value, said: str) -> None:
    assert typed(value) == said
    (found,) = parse(f"mine[x={said}]")
    assert found.options["x"] == (value if isinstance(value, str) else said)
