"""What an exception says, in one line: all of it, and the user's own line that it came from."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from matbench.errors import LONGEST_NAME, UserError, failure, one_line, refuse_hidden, where


class Silent(Exception):
    """Has a message that cannot be had."""

    def __str__(self) -> str:
        raise RuntimeError("no message today")


class NoText(Exception):
    """Has something else than a text for its message."""

    def __str__(self) -> str:
        return None  # type: ignore[return-value]


def _raised(act: Callable[[], object]) -> BaseException:
    try:
        act()
    except BaseException as error:
        return error
    raise AssertionError("nothing was raised")


def _run(code: str) -> Callable[[], object]:
    return lambda: subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def _raise(error: BaseException) -> object:
    raise error


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (Path("missing.bin").read_bytes, ["[Errno 2] No such file or directory: 'missing.bin'"]),
        (Path().read_bytes, ["[Errno 21] Is a directory: '.'"]),
        (lambda: _raise(PermissionError(13, "Permission denied", "a", None, "b")), ["Permission denied: 'a' -> 'b'"]),
        (lambda: _raise(OSError("only words")), ["only words"]),
        (lambda: b"\xff".decode(), ["'utf-8' codec can't decode byte 0xff in position 0"]),
        (lambda: "\udc80".encode(), ["'utf-8' codec can't encode", "surrogates not allowed"]),
        (_run("raise SystemExit(3)"), ["returned non-zero exit status 3", "raise SystemExit(3)"]),
        (_run("import sys; print('no licence', file=sys.stderr); sys.exit(3)"), ["status 3. It printed: no licence"]),
        (_run("print(open('left.raw'))"), ["It printed: FileNotFoundError: [Errno 2] No such file", "'left.raw'"]),
        (lambda: subprocess.run(["sleep", "9"], timeout=0.01), ["Command '['sleep', '9']' timed out"]),
        (lambda: {}["depth"], ["'depth'"]),
        (lambda: _raise(ValueError("window", 4, "is even")), ["('window', 4, 'is even')"]),
        (lambda: _raise(ValueError("first\n\n   second\n third ")), ["first second third"]),
        (lambda: _raise(TypeError("\x1b[1mUnknown\x1b[0m\tattribute\a 'foo'\u2028")), ["Unknown attribute 'foo'"]),
        (lambda: _raise(np.linalg.LinAlgError("Singular matrix")), ["Singular matrix"]),
        (lambda: _raise(SystemExit(3)), ["3"]),
        (lambda: _raise(ExceptionGroup("two things", [ValueError("a"), KeyError("b")])), ["two things (2 sub-"]),
        (lambda: compile("a b", "mine.py", "exec"), ["invalid syntax", "mine.py, line 1"]),
    ],
)
def test_the_whole_message_stands_in_one_line(act: Callable[[], object], words: list[str]) -> None:
    error = _raised(act)
    said = one_line(error)
    assert "\n" not in said
    assert all(word in said for word in words), said
    assert failure(error).startswith(f"{type(error).__name__}: {said}")


@pytest.mark.parametrize("error", [ValueError(), KeyboardInterrupt(), AssertionError(""), ValueError(" \n ")])
def test_an_exception_without_a_message_is_told_by_its_type_once(error: BaseException) -> None:
    assert one_line(error) == failure(error) == type(error).__name__


@pytest.mark.parametrize("error", [Silent(), NoText()])
def test_a_message_that_cannot_be_had_is_told_as_such(error: BaseException) -> None:
    assert "failed" in one_line(error)
    assert failure(error).startswith(type(error).__name__)


def test_a_very_long_message_keeps_its_two_ends() -> None:
    said = one_line(ValueError("it began " + "x" * 10_000_000 + " it ended"))
    assert said.startswith("it began x")
    assert said.endswith("x it ended")
    assert " 9998018 characters left out " in said
    assert len(said) < 2100


def test_a_users_error_says_enough() -> None:
    assert failure(UserError("size=3 of synthetic/box: 32 is possible")) == "size=3 of synthetic/box: 32 is possible"


def _module(path: Path, text: str) -> dict[str, object]:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    names: dict[str, object] = {}
    exec(compile(text, str(path), "exec"), names)  # noqa: S102
    return names


def test_where_is_the_last_line_of_the_users_own_code(tmp_path: Path) -> None:
    library = _module(tmp_path / "lib/python3/site-packages/deep.py", "def call(f):\n    return f()\n")["call"]
    text = "import json\n\ndef bad():\n    return json.loads('{')\n\ndef good(call):\n    return call(bad)\n"
    own = _module(tmp_path / "mine.py", text)
    assert where(_raised(own["bad"])) == "mine.py:4", "json raised it, line 4 asked for it"
    assert where(_raised(lambda: own["good"](library))) == "mine.py:4"
    assert failure(_raised(own["bad"])).endswith(" (mine.py:4)")


def test_what_the_harness_alone_raises_has_no_place(tmp_path: Path) -> None:
    assert where(ValueError("never raised")) == ""
    own = _module(tmp_path / "mine.py", "from matbench.scene import Range\n\ndef bad():\n    return Range(3, 1)\n")
    assert where(_raised(own["bad"])) == "mine.py:4", "asked for by this line"


def test_a_name_has_an_end() -> None:
    refuse_hidden("scene", "a" * LONGEST_NAME)
    with pytest.raises(UserError, match="scene has 4097 characters: names may have 4096"):
        refuse_hidden("scene", "a" * (LONGEST_NAME + 1))
