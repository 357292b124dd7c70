"""TIFF files: what they claim is read without unpacking them."""

import cv2
import numpy as np
import pytest

from matbench.files import tiff

PICTURE = np.random.default_rng(0).integers(0, 256, (7, 11, 3), np.uint8)


@pytest.mark.parametrize("packing", [1, 5, 8, 32773])
def test_size_and_content(packing: int) -> None:
    data = cv2.imencode(".tif", PICTURE, [cv2.IMWRITE_TIFF_COMPRESSION, packing])[1].tobytes()
    assert tiff.is_tiff(data)
    assert tiff.size(data) == (7, 11)
    found = tiff.decode(data)
    assert found is not None
    np.testing.assert_array_equal(found, PICTURE)
    assert tiff.decode(data[:-3]) is None


@pytest.mark.parametrize("data", [b"", b"II*\0", b"II*\0" + b"\xff" * 60, b"MM\0*\0\0\0\x08\xff\xff" + bytes(30)])
def test_what_is_none_has_no_size(data: bytes) -> None:
    assert not tiff.size(data)
    assert tiff.decode(data) is None
