"""PFM files: read exactly, or refused in one line that names the file."""

import tracemalloc
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from real import Real
from scene_files import check_one_line, pfm_bytes

from matbench.errors import UserError
from matbench.files.pfm import read_disparities

MAP = np.random.default_rng(0).normal(0, 3, (5, 7)).astype(np.float32)
IN_ONE_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def _refused(path: Path, *words: str) -> None:
    with pytest.raises(UserError) as caught:
        read_disparities(path, (7, 5))
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in (str(path), *words)), message


@pytest.mark.parametrize("little", [True, False])
def test_numbers_come_back_in_either_byte_order(tmp_path: Path, little: bool) -> None:
    path = tmp_path / "map.pfm"
    path.write_bytes(pfm_bytes(MAP, little))
    np.testing.assert_array_equal(read_disparities(path, (7, 5)), MAP)


def test_what_opencv_writes_is_read_the_same(tmp_path: Path) -> None:
    path = tmp_path / "map.pfm"
    assert cv2.imwrite(str(path), MAP)
    np.testing.assert_array_equal(read_disparities(path), MAP)


def test_the_real_map_is_as_opencv_reads_it(real: Real) -> None:
    name = "hci/additional/antinous/gt_disp_lowres.pfm"
    path = real(name) / name
    found = read_disparities(path, (512, 512))
    np.testing.assert_array_equal(found, cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
    assert found[-1].mean() > found[0].mean(), "the floor at the bottom is nearer than the wall behind the top"


def test_what_is_not_finite_is_unknown(tmp_path: Path) -> None:
    path, values = tmp_path / "map.pfm", MAP.copy()
    values[0, :3] = np.inf, -np.inf, np.nan
    path.write_bytes(pfm_bytes(values))
    found = read_disparities(path)
    assert np.isnan(found[0, :3]).all()
    np.testing.assert_array_equal(found[1:], MAP[1:])


@pytest.mark.parametrize("values", [MAP, np.arange(35, dtype=np.float32).reshape(5, 7) / 4])
def test_the_wrong_byte_order_is_noticed(tmp_path: Path, values: np.ndarray) -> None:
    path = tmp_path / "map.pfm"
    path.write_bytes(pfm_bytes(values, little=True).replace(b"\n-1.0\n", b"\n1.0\n", 1))
    _refused(path, "order")


def test_truncated_anywhere_is_refused(tmp_path: Path) -> None:
    path, data = tmp_path / "map.pfm", pfm_bytes(MAP)
    for length in range(len(data)):
        path.write_bytes(data[:length])
        _refused(path)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", ["Pf"]),
        (b"PF\n7 5\n-1\n" + bytes(420), ["coloured"]),
        (b"P5\n7 5\n255\n" + bytes(35), ["P5"]),
        (b"Pf\n999999999 999999999\n-1\n", ["999999999x999999999", "64000000"]),
        (b"Pf\n8000 8000\n-1\n1234", ["8000x8000"]),
        (b"Pf\n0 5\n-1\n", ["0x5"]),
        (b"Pf\n-7 5\n-1\n" + bytes(140), ["Pf"]),
        (b"Pf\n7 5\n0\n" + bytes(140), ["scale 0"]),
        (b"Pf\n7 5\nnan\n" + bytes(140), ["Pf"]),
        (b"Pf\n7 5\n1e999\n" + bytes(140), ["scale 1e999"]),
        (b"Pf\n7 5\n1-e\n" + bytes(140), ["scale 1-e"]),
        (b"Pf\n7 5\n-1\n" + bytes(144), ["damaged", "144", "140"]),
        (b"Pf\n5 7\n-1\n" + bytes(140), ["5x7", "7x5"]),
    ],
)
def test_malformed_is_refused(tmp_path: Path, data: bytes, words: list[str]) -> None:
    path = tmp_path / "map.pfm"
    path.write_bytes(data)
    _refused(path, *words)


def test_a_claim_is_not_allocated(tmp_path: Path) -> None:
    path = tmp_path / "map.pfm"
    path.write_bytes(b"Pf\n8000 8000\n-1.0\n" + bytes(1000))
    tracemalloc.start()
    with pytest.raises(UserError, match="truncated"):
        read_disparities(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000, "a map of 8000x8000 takes 256 MB"


@IN_ONE_FOLDER
@given(st.binary(max_size=120))
def test_any_bytes_are_a_map_or_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "map.pfm"
    for content in (data, b"Pf\n" + data, b"Pf\n2 2\n-1\n" + data):
        path.write_bytes(content)
        try:
            found = read_disparities(path)
        except UserError as error:
            check_one_line(error)
        else:
            assert found.dtype == np.float32
            assert found.nbytes <= len(content)


@IN_ONE_FOLDER
@given(st.integers(0, 1000), st.binary(min_size=1, max_size=3))
def test_a_damaged_file_is_never_another_size(tmp_path: Path, at: int, patch: bytes) -> None:
    path, data = tmp_path / "map.pfm", bytearray(pfm_bytes(MAP))
    at %= len(data)
    data[at : at + len(patch)] = patch
    path.write_bytes(bytes(data))
    try:
        found = read_disparities(path, (7, 5))
    except UserError as error:
        check_one_line(error)
    else:
        assert found.shape == MAP.shape
