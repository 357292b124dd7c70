"""TOML files that are not trusted."""

import os
from pathlib import Path

import pytest

from matbench.errors import UserError
from matbench.files.toml import LARGEST, read_toml


def test_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("views = ['ä.png']", encoding="utf-8")
    assert read_toml(tmp_path / "a.toml", "scene file") == {"views": ["ä.png"]}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"a = " + b"[" * 100_000, "is not TOML: nested too deeply"),
        (b"a = {b=" * 50_000, "is not TOML"),
        (b"a = '\xff'", "is not TOML"),
        (b"a = 1e", "is not TOML"),
        (
            b"\xef\xbb\xbfa = 1",
            "begins with a byte-order mark: TOML has none, save it as UTF-8 without one",
        ),
        ("a = 1".encode("utf-16"), "is UTF-16 (in Windows, 'Unicode'): save it as UTF-8"),
        ("a = 1".encode("utf-16-be"), "is UTF-16"),
        (b"#" * (LARGEST + 1), f"has {LARGEST + 1} bytes"),
    ],
)
def test_anything_else_is_refused_in_one_line(content: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_bytes(content)
    with pytest.raises(UserError, match=r"a\.toml") as error:
        read_toml(tmp_path / "a.toml", "request")
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_what_never_ends_is_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.toml")
    with pytest.raises(UserError, match="is a pipe and no file"):
        read_toml(tmp_path / "a.toml", "request")
