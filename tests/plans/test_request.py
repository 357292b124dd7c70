"""Requests as people write them."""

from pathlib import Path

import pytest

from matbench.errors import UserError
from matbench.plans.request import read_request, seeds_of


def test_a_request_is_read(tmp_path: Path) -> None:
    (tmp_path / "request.toml").write_text("algorithms = ['sgbm', 'materiality[pairs=all,consecutive]']")
    algorithms = ["sgbm", "materiality[pairs=all,consecutive]"]
    assert read_request(tmp_path / "request.toml") == (algorithms, None)
    with pytest.raises(UserError, match=r"request .*none\.toml is missing"):
        read_request(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("algorithms = 3", "algorithms is 3, not a list of texts"),
        ("algorithms = ['flat'", "is not TOML"),
        ("scenes = ['synthetic/box']", "names no algorithms"),
        ("algorithm = ['flat']", "did you mean 'algorithms'?"),
    ],
)
def test_a_malformed_request_is_refused(tmp_path: Path, content: str, said: str) -> None:
    (tmp_path / "request.toml").write_text(content)
    with pytest.raises(UserError, match=r"request\.toml") as error:
        read_request(tmp_path / "request.toml")
    assert said in str(error.value)


@pytest.mark.parametrize(("given", "seeds"), [(3, [3]), ([2, 0, 2], [2, 0]), (range(3), [0, 1, 2])])
def test_seeds_are_taken_once_each(given: object, seeds: list[int]) -> None:
    assert seeds_of(given) == seeds


@pytest.mark.parametrize("given", [2**64, -1, True, 1.5, "1", [], [0, -2], None])
def test_what_is_no_seed_is_refused(given: object) -> None:
    with pytest.raises(UserError, match="is not one or several whole numbers from 0"):
        seeds_of(given)
