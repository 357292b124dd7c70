"""JPEG headers: the size is that of the picture, not that of a preview, and nothing but a whole file is decoded."""

import cv2
import numpy as np
import pytest

from matbench.files import jpeg

PICTURE = np.random.default_rng(0).integers(0, 256, (7, 11, 3), np.uint8)
DATA = cv2.imencode(".jpg", PICTURE)[1].tobytes()


def _with_segment(content: bytes, marker: int = 0xE1) -> bytes:
    return DATA[:2] + bytes((0xFF, marker)) + (len(content) + 2).to_bytes(2, "big") + content + DATA[2:]


def test_a_preview_in_the_header_is_not_the_picture() -> None:
    preview = cv2.imencode(".jpg", PICTURE[:3, :2])[1].tobytes()
    whole = _with_segment(b"Exif\0\0" + preview)
    assert jpeg.size(whole) == (11, 7)
    jpeg.check_whole(whole)
    with pytest.raises(jpeg.NotJpeg, match="end before"):
        jpeg.check_whole(whole[:-2])


def test_filling_bytes_and_what_follows_the_picture_do_no_harm() -> None:
    assert jpeg.size(DATA[:2] + b"\xff\xff" + DATA[2:]) == (11, 7)
    jpeg.check_whole(DATA + b"trailing")


@pytest.mark.parametrize(
    "data", [b"", b"\xff\xd8", b"\xff\xd8\xff", b"\xff\xd8" + bytes(40), b"\xff\xd8\xff\xe0\0\0" * 9000]
)
def test_what_has_no_header_is_refused(data: bytes) -> None:
    with pytest.raises(jpeg.NotJpeg, match="no JPEG header"):
        jpeg.size(data)


def test_twelve_bits_are_refused() -> None:
    at = DATA.index(b"\xff\xc0") + 4
    with pytest.raises(jpeg.NotJpeg, match="12 bits"):
        jpeg.size(DATA[:at] + b"\x0c" + DATA[at + 1 :])
