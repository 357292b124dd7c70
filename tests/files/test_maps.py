"""Disparity maps in whatever format people have them."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from scene_files import pfm_bytes

from matbench.errors import UserError
from matbench.files.maps import ENDINGS, read_map

NUMBERS = np.arange(12, dtype=np.float32).reshape(3, 4) * 3


def written(path: Path, numbers: np.ndarray = NUMBERS) -> Path:
    match path.suffix:
        case ".pfm":
            path.write_bytes(pfm_bytes(numbers))
        case ".npy":
            np.save(path, numbers)
        case ".npz":
            np.savez_compressed(path, disparity=numbers)
        case ".tif" | ".tiff":
            assert cv2.imwrite(str(path), numbers)
        case _:
            assert cv2.imwrite(str(path), numbers.astype(np.uint16))
    return path


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_format_holds_the_same_numbers(ending: str, tmp_path: Path) -> None:
    assert np.array_equal(read_map(written(tmp_path / f"a{ending}")), NUMBERS)


@pytest.mark.parametrize("kind", [np.float64, np.float16, np.int16, np.uint8])
def test_any_type_of_number(kind: type, tmp_path: Path) -> None:
    assert np.array_equal(read_map(written(tmp_path / "a.npy", NUMBERS.astype(kind))), NUMBERS)


@pytest.mark.parametrize("shape", [(1, 3, 4), (3, 4, 1)])
def test_one_channel_is_no_third_side(shape: tuple[int, ...], tmp_path: Path) -> None:
    assert np.array_equal(read_map(written(tmp_path / "a.npy", NUMBERS.reshape(shape))), NUMBERS)


def test_what_is_not_finite_is_no_answer(tmp_path: Path) -> None:
    numbers = NUMBERS.astype(np.float64)
    numbers[0, :3] = np.inf, -np.inf, 1e300
    found = read_map(written(tmp_path / "a.npy", numbers))
    assert np.isnan(found[0, :3]).all()
    assert np.array_equal(found[1:], NUMBERS[1:])


def _bad(folder: Path, name: str, content: bytes) -> Path:
    (folder / name).write_bytes(content)
    return folder / name


@pytest.mark.parametrize("ending", ENDINGS)
def test_nothing_and_nonsense_are_one_line(ending: str, tmp_path: Path) -> None:
    for content in (b"", b"nonsense" * 20, written(tmp_path / f"good{ending}").read_bytes()[:-9]):
        with pytest.raises(UserError) as found:
            read_map(_bad(tmp_path, f"a{ending}", content))
        assert "\n" not in str(found.value)
        assert f"a{ending}" in str(found.value)
    with pytest.raises(UserError, match="missing"):
        read_map(tmp_path / f"none{ending}")


def test_other_kinds_and_shapes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"ends in '.jpg'"):
        read_map(tmp_path / "a.jpg")
    for numbers in (np.zeros((3, 4, 3)), np.zeros(5), np.array([["x"]]), np.zeros((0, 4)), np.ones((2, 2), complex)):
        with pytest.raises(UserError, match=r"rows and columns of numbers|no numbers"):
            read_map(written(tmp_path / "a.npy", numbers))
    np.savez(tmp_path / "two.npz", a=NUMBERS, b=NUMBERS)
    with pytest.raises(UserError, match="holds the arrays a, b: one is needed"):
        read_map(tmp_path / "two.npz")
    np.save(tmp_path / "pickled.npy", np.array([{}], object), allow_pickle=True)
    with pytest.raises(UserError, match="cannot be read"):
        read_map(tmp_path / "pickled.npy")


@pytest.mark.parametrize(
    ("kind", "shape"),
    [("<f4", (100000, 100000)), ("<U500000000", (60, 1000)), (("<f4", (1000000,)), (1000, 1000)), ("<f4", (True, 4))],
)
def test_an_array_is_not_believed_before_it_is_looked_at(kind: object, shape: tuple[int, ...], tmp_path: Path) -> None:
    head = f"{{'descr': {kind!r}, 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    with pytest.raises(UserError, match=r"a\.npy"):
        read_map(_bad(tmp_path, "a.npy", b"\x93NUMPY\x01\x00v\x00" + head + b"\0" * 64))


def tiff(width: int, height: int, order: str = "<", big: bool = False) -> bytes:
    """A TIFF of 8 bits a pixel, all 0 and packed: a thousandth of what it unpacks to."""
    packer = zlib.compressobj()
    packed = b"".join(packer.compress(bytes(width)) for _ in range(height)) + packer.flush()
    place = len(packed) + (16 if big else 8)
    long = "Q" if big else "I"
    entries = {256: width, 257: height, 258: 8, 259: 8, 262: 1, 273: place - len(packed), 278: height, 279: len(packed)}
    head = struct.pack(f"{order}2sH", b"II" if order == "<" else b"MM", 43 if big else 42)
    head += struct.pack(f"{order}HHQ", 8, 0, place) if big else struct.pack(f"{order}I", place)
    listed = b"".join(
        struct.pack(f"{order}HH{long}{long}", tag, 16 if big else 4, 1, value) for tag, value in entries.items()
    )
    return head + packed + struct.pack(f"{order}{'Q' if big else 'H'}", len(entries)) + listed + bytes(8)


@pytest.mark.parametrize(("order", "big"), [("<", False), (">", False), ("<", True)])
def test_a_tiff_is_not_unpacked_if_it_claims_too_much(
    order: str, big: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert read_map(_bad(tmp_path, "good.tif", tiff(7, 5, order, big))).shape == (5, 7)
    bad = _bad(tmp_path, "a.tif", tiff(10_000, 7_000, order, big))
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("it was unpacked"))
    with pytest.raises(UserError, match=r"claims to be \(7000, 10000\)"):
        read_map(bad)


def test_another_picture_is_no_tiff(tmp_path: Path) -> None:
    written(tmp_path / "a.png").rename(tmp_path / "a.tif")
    with pytest.raises(UserError, match="no TIFF"):
        read_map(tmp_path / "a.tif")
