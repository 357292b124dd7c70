"""Documents from elsewhere are read within bounds: bytes, brackets, depth."""

import json
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from matbench.files.documents import parse_json, read_json, read_toml


def test_a_document_is_read(tmp_path: Path) -> None:
    cells = {"cells": [{"method": {"params": {"a": 1}}, "scene": "synthetic/box[n=3]"}] * 2000, "é": [1.5, None, "["]}
    (tmp_path / "a.json").write_text(json.dumps(cells), encoding="utf-8")
    assert read_json(tmp_path / "a.json", most=1 << 20) == cells
    (tmp_path / "a.toml").write_text('views = ["a.b.png", "c=d.png"]\n[truth."a.b.png"]\nscale = 1.5\n')
    assert read_toml(tmp_path / "a.toml", most=1 << 20)["truth"] == {"a.b.png": {"scale": 1.5}}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"[" * 3000, "nested too deeply"),
        (b"[" + b"[]," * 200_000 + b"1]", "200001 brackets in 600003 bytes"),
        (b"{" + b"}", None),
        (b"\xff", "codec"),
        (b"9" * 5000, "digits"),
        (b"", "Expecting value"),
    ],
)
def test_json_that_would_take_more_than_its_bytes_is_refused(content: bytes, words: str | None) -> None:
    if words is None:
        assert parse_json(content) == {}
        return
    with pytest.raises(ValueError, match=words):
        parse_json(content)


@pytest.mark.parametrize(
    "text",
    [
        "a" + ".a" * 20_000 + " = 1",
        "[" + "a." * 20_000 + "a]",
        "x = {a" + ".a" * 20_000 + " = 1}",
        "a = " + "[" * 5000,
        "a = " + "{b = " * 5000,
    ],
)
def test_toml_that_is_deep_is_refused_at_once(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.toml").write_text(text)
    begin = time.process_time()
    with pytest.raises(ValueError, match="nested too deeply"):
        read_toml(tmp_path / "a.toml", most=1 << 20)
    assert time.process_time() - begin < 1


@pytest.mark.parametrize("read", [read_json, read_toml])
def test_a_large_file_is_not_read(tmp_path: Path, read: Callable[..., object]) -> None:
    (tmp_path / "a").write_text(" " * 101)
    with pytest.raises(ValueError, match="a has 101 bytes: 100 are possible"):
        read(tmp_path / "a", most=100)
    (tmp_path / "link").symlink_to("/dev/zero")
    with pytest.raises(ValueError, match="link is a device"):
        read(tmp_path / "link", most=100)


@pytest.mark.parametrize("before", ["", "x = 1\n", "x = {", "x = [1, {"])
def test_a_dotted_key_without_its_value_is_refused_at_once(tmp_path: Path, before: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(before + "a." * 300_000)
    with pytest.raises(ValueError, match="nested too deeply"):
        read_toml(path, most=1 << 20)
    path.write_text("views = [" + ", ".join(f'"view.{k}.png"' for k in range(300)) + "]\n")
    assert len(read_toml(path, most=1 << 20)["views"]) == 300
