"""Ways to spoil a file: by bytes, by numbers, by structure, by size, and by what lies under its name."""

import io
import json
import os
import re
import socket
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from math import prod
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

NUMBERS = [b"0", b"-1", b"1e999", b"1.7e308", b"2147483648", b"9223372036854775808", b"9" * 400, b"NaN", b"-Infinity"]
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_JUNK = [b"\0", b"\xff" * 8, b"\x1b[31m", b"[" * 500, b"{" * 500, b'"', b"\n" * 3, b"=", b"'" * 9, "é\u2028".encode()]


def flip(content: bytes, random: Random) -> bytes:
    changed = bytearray(content or b"\0")
    for _ in range(random.choice((1, 1, 1, 4, 30))):
        changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def overwrite(content: bytes, random: Random) -> bytes:
    """Extremes where a length, a count or an offset may stand."""
    width = random.choice((1, 2, 4, 8))
    at = random.randrange(max(1, len(content) - width))
    value = random.choice((b"\xff" * width, b"\0" * width, b"\xff" * (width - 1) + b"\x7f", random.randbytes(width)))
    return content[:at] + value + content[at + width :]


def cut(content: bytes, random: Random) -> bytes:
    return content[: random.randrange(len(content) + 1)]


def cut_out(content: bytes, random: Random) -> bytes:
    begin, end = sorted(random.randrange(len(content) + 1) for _ in range(2))
    return content[:begin] + content[end:]


def repeat(content: bytes, random: Random) -> bytes:
    begin = random.randrange(len(content) + 1)
    piece = content[begin : begin + random.choice((1, 8, 200))]
    return content[:begin] + piece * random.choice((2, 50, 3000)) + content[begin:]


def insert(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    return content[:at] + random.choice(_JUNK) + content[at:]


def blow_up(content: bytes, random: Random) -> bytes:
    """Blanks, commas or brackets by the hundred thousand, where a parser may count, keep or nest them."""
    at = random.choice((3, random.randrange(len(content) + 1)))
    return (
        content[:at] + random.choice((b" ", b",", b"[", b"\n", b"a.", b"0", b"[],", b"x=1,2 ")) * 300_000 + content[at:]
    )


def other_numbers(content: bytes, random: Random) -> bytes:
    found = list(_NUMBER.finditer(content))
    for one in sorted(random.sample(found, min(len(found), random.choice((1, 1, 3)))), key=lambda m: -m.start()):
        content = content[: one.start()] + random.choice(NUMBERS) + content[one.end() :]
    return content


def _values(found: Any, places: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    for key, value in list(found.items() if isinstance(found, dict) else enumerate(found)):
        places.append((found, key))
        if isinstance(value, dict | list):
            _values(value, places)
    return places


def other_json(content: bytes, random: Random) -> bytes:
    """A value of another type or size somewhere; the names of scenes that stand for very many."""
    try:
        found = json.loads(content)
        places = _values(found, [])
    except (ValueError, AttributeError, TypeError):
        return flip(content, random)
    many = "synthetic/box[" + " ".join(f"o{k}=1,2" for k in range(40)) + "]"
    values = [
        None,
        True,
        -1,
        1.7e308,
        10**30,
        "",
        "x" * 100_000,
        "\x1b]0;",
        [],
        {},
        [[]] * 2000,
        many,
        "a" + "," * 60_000,
    ]
    if places:
        for where, key in random.sample(places, min(len(places), random.choice((1, 1, 2)))):
            where[key] = random.choice(values)
    return json.dumps(found).encode()


def members_changed(content: bytes, random: Random) -> bytes:
    """One member of an archive spoilt, in an archive that is whole again: checksums stop nothing."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {info.filename: archive.read(info) for info in archive.infolist()}
    except Exception:
        return flip(content, random)
    if not members:
        return content
    name = random.choice(list(members))
    members[name] = random.choice((flip, overwrite, cut, other_numbers, insert, other_json, blow_up))(
        members[name], random
    )
    return _archive(members, random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))


def claims_changed(content: bytes, random: Random) -> bytes:
    """An array that says that it is of another shape or kind."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {info.filename: archive.read(info) for info in archive.infolist()}
        name = random.choice(list(members))
        held = io.BytesIO(members[name])
        version = np.lib.format.read_magic(held)
        shape, order, kind = np.lib.format.read_array_header_1_0(held)
        assert version == (1, 0)
    except Exception:
        return flip(content, random)
    factor = random.choice((0, -1, 2, 1 << 12, 1 << 40))
    changed = random.choice((tuple(n * factor for n in shape), (*shape, factor), (), (1 << 60,) * 3))
    said = random.choice(("|O", "<f4", "<f8", "|V9", "<U99", "|u1", kind.str))
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": said, "fortran_order": order, "shape": changed})
    members[name] = head.getvalue() + held.read()
    return _archive(members, zipfile.ZIP_DEFLATED)


def chunks_changed(content: bytes, random: Random) -> bytes:
    """A PNG of another size, depth or content, with right checksums."""
    if not content.startswith(b"\x89PNG") or len(content) < 40:
        return overwrite(content, random)
    head = bytearray(content[16:29])
    head[random.randrange(13)] = random.randrange(256)
    packed = zlib.compress(bytes(random.choice((10, 10**6, 5 * 10**7))), 9)
    body = random.choice((content[33:], _chunk(b"IDAT", packed) + _chunk(b"IEND", b"")))
    return content[:8] + _chunk(b"IHDR", bytes(head)) + body


def photograph_changed(content: bytes, random: Random) -> bytes:
    """A TIFF with another entry in its directory, or a JPEG with other numbers in the head of a segment."""
    changed = bytearray(content)
    if content[:4] == b"II*\0" and len(content) > 8:
        place = int.from_bytes(content[4:8], "little")
        entries = int.from_bytes(content[place : place + 2], "little")
        at = place + 2 + 12 * random.randrange(max(1, entries)) + random.choice((0, 2, 4, 8))
        value = random.choice((0, 1, 3, 255, 2**16 - 1, 2**31, 2**32 - 1, random.randrange(2**16)))
        changed[at : at + 4] = value.to_bytes(4, "little")
        return bytes(changed)
    heads = [at for at in range(len(content) - 9) if content[at] == 0xFF and 0xC0 <= content[at + 1] < 0xFF]
    if content[:2] != b"\xff\xd8" or not heads:
        return overwrite(content, random)
    at = random.choice(heads) + random.randrange(1, 9)
    changed[at : at + 2] = random.randbytes(2)
    return bytes(changed)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")


def _zeros(shape: tuple[int, ...], kind: str) -> Iterator[bytes]:
    """An array of zeros as it is saved, in pieces."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": kind, "fortran_order": False, "shape": shape})
    yield head.getvalue()
    left = prod(shape) * np.dtype(kind).itemsize
    while left:
        piece = min(left, 1 << 22)
        yield bytes(piece)
        left -= piece


@cache
def bombs() -> tuple[bytes, ...]:
    """Archives of a few megabytes that unpack to hundreds, or to gigabytes, and say so."""
    maps = {"view_2.npy": _zeros((8000, 8000), "<f4")}
    planes = 2500
    facts = {"space.npy": np.array([5, 36, 48, 0, planes - 1, 1], np.int64), "views.npy": np.arange(5)}
    levels: dict[str, bytes | Iterable[bytes]] = {"levels.npy": _zeros((36, planes, 48 + 4 * (planes - 1)), "|u1")}
    for name, array in facts.items():
        held = io.BytesIO()
        np.save(held, array)
        levels[name] = held.getvalue()
    text = {"plan.json": (b" " * (1 << 20) for _ in range(300)), "manifest.json": b'{"files": {}}'}
    many = {f"cells/{k:016x}/log.txt": b"" for k in range(20_000)}
    return tuple(_archive(one, zipfile.ZIP_DEFLATED) for one in (maps, levels, text, many))


def bomb(_: bytes, random: Random) -> bytes:
    return random.choice(bombs())


def _archive(members: Mapping[str, bytes | Iterable[bytes]], method: int) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", method) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name)
            info.compress_type, info._compresslevel = method, 1  # type: ignore[attr-defined]
            with archive.open(info, "w") as member:
                for piece in [content] if isinstance(content, bytes) else content:
                    member.write(piece)
    return held.getvalue()


CONTENT: list[Callable[[bytes, Random], bytes]] = [
    *(flip, flip, overwrite, cut, cut_out, repeat, insert, other_numbers, other_numbers),
    *(other_json, other_json, members_changed, members_changed, claims_changed, chunks_changed, blow_up),
    photograph_changed,
]


def pipe(path: Path) -> None:
    os.mkfifo(path)


def endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def terminal(path: Path) -> None:
    path.symlink_to("/dev/ptmx")


def circle(path: Path) -> None:
    path.symlink_to(path.name)


def dangling(path: Path) -> None:
    path.symlink_to("nothing")


def folder(path: Path) -> None:
    path.mkdir()


def sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(1 << 40)


def listening(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as one, Here(path.parent):
        one.bind(path.name)


def secret(path: Path) -> None:
    path.symlink_to("/proc/self/environ")


def gone(_: Path) -> None:
    """The file is missing."""


PLACE = [pipe, endless, terminal, circle, dangling, folder, sparse, listening, secret, gone]


class Here:
    """A folder as the working folder: a socket's name must be short."""

    def __init__(self, place: Path) -> None:
        self.place, self.before = place, Path.cwd()

    def __enter__(self) -> None:
        os.chdir(self.place)

    def __exit__(self, *_: object) -> None:
        os.chdir(self.before)
