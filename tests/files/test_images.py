"""Image files: read exactly, or refused in one line that names the file."""

import struct
import tracemalloc
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from real import Real
from scene_files import check_one_line

from matbench.errors import UserError
from matbench.files import images
from matbench.files.images import encoding, read_levels, read_rgb, read_size

PICTURE = np.random.default_rng(0).integers(0, 256, (7, 11, 3), np.uint8)
DEEP = np.random.default_rng(1).integers(0, 65536, (7, 11), np.uint16)


def _png(image: np.ndarray) -> bytes:
    return cv2.imencode(".png", image[..., ::-1] if image.ndim == 3 else image)[1].tobytes()


def _pnm(image: np.ndarray, header: str = "{kind}\n# a comment\n{w} {h}\n255\n") -> bytes:
    kind = "P6" if image.ndim == 3 else "P5"
    return header.format(kind=kind, w=image.shape[1], h=image.shape[0]).encode() + image.tobytes()


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def _forged_png(width: int, height: int, pixels: bytes, bits: int = 8) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", zlib.compress(pixels)) + _chunk(b"IEND", b"")
    )


def _refused(path: Path, *words: str, size: tuple[int, int] | None = None) -> None:
    with pytest.raises(UserError) as caught:
        read_rgb(path, size)
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in (str(path), *words)), message


@pytest.mark.parametrize("encode", [_png, _pnm])
def test_colour_and_grey_come_back(tmp_path: Path, encode) -> None:
    path = tmp_path / "image"
    path.write_bytes(encode(PICTURE))
    np.testing.assert_array_equal(read_rgb(path), PICTURE)
    np.testing.assert_array_equal(read_rgb(path, (11, 7)), PICTURE)
    assert read_size(path) == (11, 7)
    with pytest.raises(UserError, match="is coloured"):
        read_levels(path)
    path.write_bytes(encode(PICTURE[..., 0]))
    np.testing.assert_array_equal(read_levels(path), PICTURE[..., 0])


@pytest.mark.parametrize("encode", [_png, _pnm])
def test_truncated_anywhere_is_refused(tmp_path: Path, encode, capfd) -> None:
    data, path = encode(PICTURE), tmp_path / "image"
    for length in range(len(data)):
        path.write_bytes(data[:length])
        _refused(path)
    assert capfd.readouterr().err == ""


def test_png_with_a_flipped_byte_is_refused(tmp_path: Path, capfd) -> None:
    data, path = _png(PICTURE), tmp_path / "image.png"
    for at in range(8, len(data)):
        path.write_bytes(data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :])
        _refused(path)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", ["is empty"]),
        (b"GIF89a whatever", ["GIF89a", "PNG", "P6"]),
        (b"P3\n1 1\n255\n0 0 0\n", ["P3"]),
        (b"P6\n9999999 9999999\n255\n", ["9999999x9999999", "64000000"]),
        (b"P6\n0 5\n255\n", ["0x5"]),
        (b"P5\n2 2\n1023\n12345678", ["1023", "255"]),
        (b"P5\n2 2\n255\n12345", ["damaged", "5 bytes", "not 4"]),
        (_forged_png(100_000, 100_000, b"\0" * 100), ["100000x100000"]),
        (_forged_png(4, 4, b"\0" * 19), ["damaged", "4x4"]),
        (_forged_png(4, 4, b"\0" * 21), ["damaged", "4x4"]),
        (_forged_png(4, 4, b"\0" * 36, bits=32), ["32 bits", "16"]),
    ],
)
def test_malformed_is_refused(tmp_path: Path, data: bytes, words: list[str]) -> None:
    path = tmp_path / "image"
    path.write_bytes(data)
    _refused(path, *words)


def test_missing_folder_and_wrong_size_are_refused(tmp_path: Path) -> None:
    _refused(tmp_path / "none.png", "missing")
    _refused(tmp_path)
    path = tmp_path / "image.png"
    path.write_bytes(_png(PICTURE))
    _refused(path, "11x7", "12x7", size=(12, 7))


@pytest.mark.parametrize(
    "name", ["scenes2001/data/venus/im0.ppm", "scenes2001/data/venus/disp2.pgm", "scenes2003/newdata/teddy/im2.png"]
)
def test_truncated_copies_of_real_files_are_refused(real: Real, tmp_path: Path, name: str) -> None:
    source = real(f"middlebury/{name}") / "middlebury" / name
    data, path = source.read_bytes(), tmp_path / source.name
    assert read_rgb(source).shape[:2] == read_size(source)[::-1]
    for length in (10, 100, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:length])
        _refused(path)


def test_png_and_ppm_of_a_real_view_agree(real: Real) -> None:
    """The masks' folder holds teddy's views again, in PNG files of their own."""
    one, same = "middlebury/scenes2003/newdata/teddy/im2.png", "middlebury/eval_v2/teddy/imL.png"
    two, alike = "middlebury/scenes2001/data/venus/im2.ppm", "middlebury/eval_v2/venus/imL.png"
    root = real(one, same, two, alike)
    np.testing.assert_array_equal(read_rgb(root / one), read_rgb(root / same))
    np.testing.assert_array_equal(read_rgb(root / two), read_rgb(root / alike))


def test_sixteen_bits_come_back_as_levels_and_rounded_as_colours(tmp_path: Path) -> None:
    path = tmp_path / "truth"
    for content in (_png(DEEP), b"P5\n11 7\n65535\n" + DEEP.astype(">u2").tobytes()):
        path.write_bytes(content)
        np.testing.assert_array_equal(read_levels(path, (11, 7)), DEEP)
        assert encoding(path) == "grey16"
        np.testing.assert_array_equal(read_rgb(path)[..., 0], np.rint(DEEP * (255 / 65535)))
    path.write_bytes(_png(PICTURE[..., 0]))
    np.testing.assert_array_equal(read_levels(path), PICTURE[..., 0])
    assert encoding(path) == "grey8"
    path.write_bytes(_png(PICTURE.astype(np.uint16) * 256))
    with pytest.raises(UserError, match="is coloured"):
        read_levels(path)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"P5\n2 2\n1000\n12345678", "1000"),
        (b"P5\n2 2\n65535\n1234567", "truncated"),
        (b"P5\n2 2\n65535\n123456789", "damaged"),
        (_forged_png(8, 4, b"\0" * 8, bits=1), "1 bits"),
        (_forged_png(4, 4, b"\0" * 35, bits=16), "4x4"),
    ],
)
def test_levels_that_mean_something_else_are_refused(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "truth"
    path.write_bytes(data)
    with pytest.raises(UserError, match=words):
        read_levels(path)


@pytest.mark.parametrize(
    "data", [_forged_png(8000, 8000, b"\0" * 999), b"P6\n8000 8000\n255\n" + bytes(999), b"P5\n8000 8000\n255\n1"]
)
def test_a_claim_is_not_allocated(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "image"
    path.write_bytes(data)
    tracemalloc.start()
    _refused(path, "8000x8000")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000, "64 MB and more are claimed"


FUZZED = {
    "png": _png(PICTURE),
    "png16": _png(DEEP),
    "ppm": _pnm(PICTURE),
    "pgm": _pnm(PICTURE[..., 0]),
    "pgm16": b"P5 11 7 65535\n" + DEEP.astype(">u2").tobytes(),
}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=300)
@given(
    st.sampled_from(sorted(FUZZED)),
    st.lists(st.tuples(st.integers(0, 400), st.binary(max_size=4)), max_size=3),
    st.integers(0, 400),
)
def test_a_damaged_file_is_whole_or_refused(
    tmp_path: Path, capfd, kind: str, patches: list[tuple[int, bytes]], cut: int
) -> None:
    data = bytearray(FUZZED[kind])
    for at, patch in patches:
        data[at % len(data) : at % len(data) + len(patch)] = patch
    path = tmp_path / "image"
    path.write_bytes(bytes(data[: max(0, len(data) - max(0, cut - 200))]))
    for read, kinds in ((read_rgb, [np.uint8]), (read_levels, [np.uint16])):
        try:
            image = read(path, (11, 7))
        except UserError as error:
            check_one_line(error)
        else:
            assert image.shape[:2] == (7, 11)
            assert image.dtype in kinds
    assert capfd.readouterr().err == ""


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 4, 8, 16, 3]),
    st.integers(0, 7),
    st.binary(max_size=200),
)
def test_any_png_header_is_told_or_refused(
    tmp_path: Path, width: int, height: int, bits: int, colour: int, pixels: bytes
) -> None:
    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    chunks = _chunk(b"IHDR", header) + _chunk(b"IDAT", zlib.compress(pixels)) + _chunk(b"IEND", b"")
    path = tmp_path / "image.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)
    for read in (read_rgb, read_levels):
        try:
            image = read(path)
        except UserError as error:
            check_one_line(error)
        else:
            assert image.shape[:2] == (height, width)
            assert width * height <= 8 * len(pixels)


@pytest.mark.parametrize("between", [b" ", b"\n", b"#\n"])
def test_megabytes_of_blanks_in_a_header_take_no_memory(tmp_path: Path, between: bytes) -> None:
    path = tmp_path / "image.ppm"
    path.write_bytes(b"P6" + between * 4_000_000 + b"2 2 255\n" + bytes(12))
    tracemalloc.start()
    for read in (images.read_rgb, images.read_size, images.encoding):
        with pytest.raises(UserError, match="starts with"):
            read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3 * path.stat().st_size


def _jpeg(image: np.ndarray, *options: int) -> bytes:
    return cv2.imencode(".jpg", image[..., ::-1] if image.ndim == 3 else image, list(options))[1].tobytes()


def _tiff(image: np.ndarray) -> bytes:
    return cv2.imencode(".tif", image[..., ::-1] if image.ndim == 3 else image)[1].tobytes()


@pytest.mark.parametrize("image", [PICTURE, PICTURE[..., 0], np.repeat(DEEP[..., None], 3, 2), DEEP])
def test_a_tiff_comes_back(tmp_path: Path, image: np.ndarray) -> None:
    path = tmp_path / "image"
    path.write_bytes(_tiff(image))
    found = read_rgb(path, (11, 7))
    wanted = image if image.dtype == np.uint8 else np.rint(image * (255 / 65535))
    np.testing.assert_array_equal(found, wanted if image.ndim == 3 else wanted[..., None].repeat(3, 2))
    assert read_size(path) == (11, 7)
    assert encoding(path) == "tiff"


def test_a_tiff_of_numbers_is_no_view(tmp_path: Path) -> None:
    path = tmp_path / "image"
    path.write_bytes(_tiff(DEEP.astype(np.float32)))
    _refused(path, "float32", "8 or 16 bits")


@pytest.mark.parametrize("options", [(), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_RST_INTERVAL, 1)])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_jpeg_comes_back_nearly(tmp_path: Path, options: tuple[int, ...], channels: int) -> None:
    path = tmp_path / "image"
    smooth = cv2.resize(PICTURE, (110, 70), interpolation=cv2.INTER_CUBIC)[..., :channels].squeeze()
    path.write_bytes(_jpeg(smooth, cv2.IMWRITE_JPEG_QUALITY, 98, *options))
    found = read_rgb(path, (110, 70))
    wanted = smooth if channels == 3 else smooth[..., None].repeat(3, 2)
    assert np.abs(found.astype(int) - wanted).mean() < 4
    assert read_size(path) == (110, 70)
    with pytest.raises(UserError, match="keeps no exact numbers"):
        encoding(path)


@pytest.mark.parametrize("encode", [_jpeg, _tiff])
def test_a_photograph_cut_anywhere_is_refused(tmp_path: Path, encode, capfd) -> None:
    data, path = encode(PICTURE), tmp_path / "image"
    for length in range(len(data)):
        path.write_bytes(data[:length])
        _refused(path)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("data", "kind"), [(b"\x93NUMPY\x01\0", "npy"), (b"PK\x03\x04", "npz"), (b"Pf\n1 1\n", "pfm"), (b"MM\0*", "tiff")]
)
def test_what_truth_is_stored_in_is_told_by_its_first_bytes(tmp_path: Path, data: bytes, kind: str) -> None:
    (tmp_path / "truth").write_bytes(data + bytes(40))
    assert encoding(tmp_path / "truth") == kind
