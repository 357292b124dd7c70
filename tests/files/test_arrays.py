"""Arrays from elsewhere: nothing is unpacked that contradicts itself or is larger than it may be."""

import io
import resource
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from matbench.files import arrays
from matbench.files.arrays import ArraysError, opened_arrays, write_arrays


def npy(array: np.ndarray) -> bytes:
    held = io.BytesIO()
    np.save(held, array)
    return held.getvalue()


def claiming(shape: tuple[int, ...], dtype: str = "<f4") -> bytes:
    """The head of an array, with nothing behind it."""
    held = io.BytesIO()
    np.lib.format.write_array_header_1_0(held, {"descr": dtype, "fortran_order": False, "shape": shape})
    return held.getvalue()


def archive(path: Path, *members: tuple[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", method) as made:
        for name, content in members:
            made.writestr(name, content)
    return path


def read(path: Path) -> dict[str, np.ndarray]:
    with opened_arrays(path) as found:
        found.check_ratio()
        return {name: found.read(name) for name in found.claims}


def test_what_is_written_is_read(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    given = {"a": rng.random((5, 7), np.float32), "b": np.asfortranarray(rng.random((3, 4))), "c": np.array("text")}
    for write in (write_arrays, lambda path, one: np.savez(path, **one)):
        write(tmp_path / "a.npz", given)
        found = read(tmp_path / "a.npz")
        assert found.keys() == given.keys()
        for name, array in given.items():
            np.testing.assert_array_equal(found[name], array)
            assert found[name].dtype == array.dtype


def test_a_constant_array_is_written_so_that_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrays, "FREE", 1 << 16)
    write_arrays(tmp_path / "a.npz", {"view_0": np.zeros((500, 500), np.float32)})
    assert (read(tmp_path / "a.npz")["view_0"] == 0).all()
    np.savez_compressed(tmp_path / "b.npz", view_0=np.zeros((500, 500), np.float32))
    with pytest.raises(ArraysError, match="claim to hold arrays of 1000000: more than 200 times"):
        read(tmp_path / "b.npz")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: path.write_bytes(b"PK"), "zip"),
        (lambda path: path.write_bytes(b""), "zip"),
        (lambda path: path.mkdir(), "is a folder and no file"),
        (lambda path: path.symlink_to("/dev/zero"), "is a device and no file"),
        (lambda path: archive(path, ("a.npy", claiming((1 << 40,)))), r"which are not \(1099511627776,\) float32"),
        (lambda path: archive(path, ("a.npy", claiming((-4,)) + bytes(16))), r"claims to be \(-4,\)"),
        (lambda path: archive(path, ("a.npy", npy(np.zeros(3))[:-1])), "which are not"),
        (lambda path: archive(path, ("a.npy", claiming((3,), "|O") + bytes(24))), "claims to be"),
        (lambda path: archive(path, ("a.txt", b"1")), "'a.txt' is no array"),
        (lambda path: archive(path, ("a.npy", b"1"), method=zipfile.ZIP_LZMA), "'a.npy' is no array"),
        (lambda path: archive(path, ("a.npy", npy(np.zeros(3))), ("a.npy", npy(np.zeros(3)))), "two arrays"),
        (lambda path: archive(path, ("a.npy", b"\x93NUMPY\x01\x00\x40\x00" + b"(" * 64)), "is damaged"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_what_contradicts_itself_is_refused(tmp_path: Path, make: Callable[[Path], object], words: str) -> None:
    path = tmp_path / "a.npz"
    make(path)
    with pytest.raises(ArraysError, match=words):
        read(path)


def test_a_missing_file_is_the_usual_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "none.npz")


def test_every_changed_byte_is_read_or_refused(tmp_path: Path) -> None:
    """What is read in spite of a changed byte is what was written: the change was in a date, or where nobody looks."""
    given = {"levels": np.arange(64, dtype=np.uint8).reshape(4, 4, 4), "space": np.arange(6)}
    write_arrays(tmp_path / "a.npz", given)
    content = (tmp_path / "a.npz").read_bytes()
    refused = 0
    for place in range(len(content)):
        for change in (1, 0x80):
            changed = bytearray(content)
            changed[place] ^= change
            (tmp_path / "b.npz").write_bytes(changed)
            try:
                found = read(tmp_path / "b.npz")
            except ArraysError:
                refused += 1
            else:
                assert all((found[name] == given[name]).all() for name in found if name in given)
    assert refused > len(content)


LIST = """
import sys
from pathlib import Path
from matbench.files.arrays import ArraysError, opened_arrays
try:
    with opened_arrays(Path(sys.argv[1])):
        pass
except ArraysError as error:
    print(error)
"""


def test_a_list_of_a_million_members_is_not_read(tmp_path: Path) -> None:
    """Its 60 MB would take a gigabyte as objects. In a process that may have half of that beyond its libraries."""
    listed = b"PK\x01\x02" + bytes(24) + (5).to_bytes(2, "little") + bytes(16) + b"a.npy"
    path = tmp_path / "a.npz"
    with path.open("wb") as file:
        file.write(listed * 1_000_000)
        size, start = 1_000_000 * len(listed), file.tell()
        file.write(b"PK\x06\x06" + (44).to_bytes(8, "little") + bytes(4 + 8))
        for number in (1_000_000, 1_000_000, size, 0):
            file.write(number.to_bytes(8, "little"))
        file.write(b"PK\x06\x07" + bytes(4) + start.to_bytes(8, "little") + (1).to_bytes(4, "little"))
        file.write(b"PK\x05\x06" + bytes(4) + b"\xff" * 12 + bytes(2))
    done = subprocess.run(
        [sys.executable, "-c", LIST, str(path)],
        capture_output=True,
        text=True,
        timeout=300,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (1 << 29, 1 << 29)),
    )
    assert "its list of members claims" in done.stdout, done.stderr
