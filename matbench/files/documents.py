"""JSON and TOML from files that are not trusted: what is large, deep or made of brackets alone is refused."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from matbench.files.plain import read_plain

_FREE, _BYTES_EACH = 1 << 12, 16
"""Lists and objects that any document may have, and the bytes that each further one must bring along.

``[[],[],[],`` takes thirty times as much memory as it has bytes; what a run stores has a bracket in 30 to 100 bytes.
"""
_DEEPEST = 100
"""Dots in a key of TOML. The parser takes the square of their number: 40 KB of them kept it busy for twelve seconds."""

_DOTTED = re.compile(r"""(?<![\w."'-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){101}""")
"""Such a key without its ``=``, which the parser looks for only after it."""


def read_json(path: Path, *, most: int, follow: bool = True) -> Any:
    """What a JSON file of at most so many bytes holds.

    Raises
    ------
    ValueError
        If it is no plain file, too large, or no JSON; said in one line.
    OSError
        If it is missing or cannot be read.
    """
    return parse_json(read_plain(path, most=most, follow=follow))


def parse_json(content: bytes) -> Any:
    """What JSON holds.

    Raises
    ------
    ValueError
        If it is none, is nested too deeply, or has more brackets than anything that is stored.
    """
    brackets = content.count(b"[") + content.count(b"{")
    if brackets > _FREE + len(content) // _BYTES_EACH:
        raise ValueError(f"{brackets} brackets in {len(content)} bytes: more than anything that is stored has")
    try:
        return json.loads(content.decode("utf-8"))
    except RecursionError:
        raise ValueError("nested too deeply") from None


def read_toml(path: Path, *, most: int, follow: bool = True) -> dict[str, Any]:
    """What a TOML file of at most so many bytes holds.

    Raises
    ------
    ValueError, OSError
        As `read_json`.
    """
    text = read_plain(path, most=most, follow=follow).decode("utf-8")
    if any(key.count(".") > _DEEPEST for line in text.splitlines() for key in _keys(line)) or _DOTTED.search(text):
        raise ValueError("nested too deeply")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _keys(line: str) -> list[str]:
    """What may be a key in a line of TOML: all that stands before a ``=``, and the head of a table."""
    return [line] if line.lstrip().startswith("[") else line.split("=")[:-1]
