"""What a dataset plug-in offers."""

from pathlib import PurePosixPath

import pytest

from matbench.errors import UserError
from matbench.plans.plugins import Plugin
from matbench.scenes.dataset import Download, Remote, loaded


class Desk:
    def listings(self, root: object) -> list[object]:
        return []


class Needy(Desk):
    def __init__(self, year: int) -> None:
        raise AssertionError("never called without a year")


class Broken(Desk):
    def __init__(self) -> None:
        raise ArithmeticError("two\nlines")


def test_a_class_is_called_and_anything_else_is_the_dataset() -> None:
    assert isinstance(loaded(Plugin("desk", "own.py", Desk)), Desk)
    entry = type("Entry", (), {"load": lambda self: made, "module": "matbench.scene", "attr": ""})()
    made = Desk()
    assert loaded(Plugin("desk", "a package", entry)) is made


@pytest.mark.parametrize(
    ("kind", "said"), [(Needy, r"dataset 'x' from own\.py: TypeError: .*year"), (Broken, "ArithmeticError: two lines")]
)
def test_one_that_cannot_be_made_is_one_line(kind: type, said: str) -> None:
    with pytest.raises(UserError, match=said) as error:
        loaded(Plugin("x", "own.py", kind))
    assert "\n" not in str(error.value)


def test_a_download_is_typed_as_a_shell_reads_it() -> None:
    one = Download("toys/my box[size=half]", PurePosixPath("toys"), (), "http://host/", ())
    assert one.command == "matbench fetch 'toys/my box[size=half]'"
    file = Remote("im0.ppm", 3, "0" * 64, also=("im0.png",), offered_as=("left.ppm",))
    assert file.names == ("im0.ppm", "im0.png"), "what lies here; a site's own names are not among them"
