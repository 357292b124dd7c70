"""Archives from elsewhere: wanted members only, whatever the archive says."""

import io
import stat
import struct
import tracemalloc
import zipfile
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from matbench.files.unzip import ArchiveError, members, opened, unpack

MEBI = 1 << 20


def archive(path: Path, *contents: tuple[str | zipfile.ZipInfo, bytes], method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", method) as made:
        for name, content in contents:
            made.writestr(name, content, compress_type=method)
    return path


def link(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.create_system = 3
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    return info


def device(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.create_system = 3
    info.external_attr = (stat.S_IFCHR | 0o666) << 16
    return info


def names(path: Path, *wanted: str) -> list[str]:
    with opened(path) as made:
        return [info.filename for info in members(made, wanted)]


def test_wanted_members_are_found_whatever_folder_they_lie_in(tmp_path: Path) -> None:
    path = archive(
        tmp_path / "a.zip",
        ("x/y/im0.ppm", b"3"),
        ("x/im0.png", b"2"),
        ("x/im0.ppm", b"1"),
        ("x/im00.ppm", b""),
        ("im0.txt", b""),
    )
    assert names(path, "im0.ppm", "im0.png") == ["x/im0.ppm", "x/im0.png", "x/y/im0.ppm"]
    with opened(path) as made:
        assert unpack(made, members(made, ["im0.png"])[0], tmp_path / "out", MEBI) == 1
    assert (tmp_path / "out").read_bytes() == b"2"


@pytest.mark.parametrize(
    "name",
    [
        "../im0.png",
        "x/../../im0.png",
        "/im0.png",
        "//host/share/im0.png",
        "C:/im0.png",
        "x\\..\\im0.png",
        "im0.png/",
        link("im0.png"),
        device("x/im0.png"),
    ],
)
def test_unsafe_members_are_passed_over(tmp_path: Path, name: str | zipfile.ZipInfo) -> None:
    path = archive(tmp_path / "a.zip", (name, b""), ("good/im0.png", b"picture"))
    assert names(path, "im0.png", "..\\im0.png") == ["good/im0.png"]


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_packings_whose_unpacking_cannot_be_bounded_are_passed_over(tmp_path: Path, method: int) -> None:
    assert names(archive(tmp_path / "a.zip", ("im0.png", b"x" * 100), method=method), "im0.png") == []


def test_encrypted_members_are_passed_over(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.zip", ("im0.png", b"x"))
    raw = bytearray(path.read_bytes())
    raw[6] |= 1  # local header's flags
    raw[raw.index(b"PK\x01\x02") + 8] |= 1  # central directory's
    path.write_bytes(raw)
    assert names(path, "im0.png") == []


def test_several_members_of_one_name_are_all_offered(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="Duplicate"):
        path = archive(tmp_path / "a.zip", ("im0.png", b"1"), ("im0.png", b"22"))
    with opened(path) as made:
        found = members(made, ["im0.png"])
        sizes = [unpack(made, info, tmp_path / str(at), MEBI) for at, info in enumerate(found)]
    assert sizes == [1, 2]


def claiming(path: Path, size: int) -> Path:
    """The same archive, whose headers claim that its one member unpacks to `size` bytes."""
    raw = bytearray(path.read_bytes())
    raw[22:26] = struct.pack("<I", size)
    central = raw.index(b"PK\x01\x02")
    raw[central + 24 : central + 28] = struct.pack("<I", size)
    path.write_bytes(raw)
    return path


@pytest.mark.parametrize(
    ("packed", "limit", "most"),
    [
        (50 * MEBI, MEBI, MEBI),
        (300 * MEBI, 1000 * MEBI, 70 * MEBI),  # 1000 to 1 is no picture
    ],
)
def test_bombs_are_not_unpacked(tmp_path: Path, packed: int, limit: int, most: int) -> None:
    path = archive(tmp_path / "a.zip", ("im0.png", bytes(packed)))
    assert path.stat().st_size < packed / 900
    with opened(path) as made, pytest.raises(ArchiveError, match=r"unpacks to more than \d+ bytes"):
        unpack(made, members(made, ["im0.png"])[0], tmp_path / "out", limit)
    assert (tmp_path / "out").stat().st_size <= most


@pytest.mark.parametrize("claim", [0, 10, MEBI])
def test_a_bomb_that_claims_to_be_small_is_not_unpacked_either(tmp_path: Path, claim: int) -> None:
    path = claiming(archive(tmp_path / "a.zip", ("im0.png", bytes(50 * MEBI))), claim)
    with opened(path) as made, pytest.raises(ArchiveError, match=r"damaged|more than"):
        unpack(made, members(made, ["im0.png"])[0], tmp_path / "out", MEBI)
    assert (tmp_path / "out").stat().st_size <= MEBI


def test_a_huge_claim_allocates_nothing(tmp_path: Path) -> None:
    path = claiming(archive(tmp_path / "a.zip", ("im0.png", b"small")), 0xFFFFFFF0)
    tracemalloc.start()
    with opened(path) as made, suppress(ArchiveError):
        unpack(made, members(made, ["im0.png"])[0], tmp_path / "out", MEBI)
    assert tracemalloc.get_traced_memory()[1] < 10 * MEBI
    tracemalloc.stop()
    assert (tmp_path / "out").read_bytes() == b"small"


def test_what_is_there_is_not_written_over(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.zip", ("im0.png", b"new"))
    (tmp_path / "out").write_bytes(b"old")
    with opened(path) as made, pytest.raises(FileExistsError):
        unpack(made, members(made, ["im0.png"])[0], tmp_path / "out", MEBI)
    assert (tmp_path / "out").read_bytes() == b"old"


@pytest.mark.parametrize("content", [b"", b"<!DOCTYPE html>", b"PK\x03\x04", b"PK\x05\x06" + bytes(10)])
def test_no_archive(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.zip").write_bytes(content)
    with pytest.raises(ArchiveError, match="no zip archive"), opened(tmp_path / "a.zip"):
        pass


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    cut=st.integers(0, 400),
    changes=st.lists(st.tuples(st.integers(0, 399), st.integers(0, 255)), max_size=6),
)
def test_damage_gives_an_archive_error_or_the_content(tmp_path: Path, cut: int, changes: list[tuple[int, int]]) -> None:
    content = b"picture" * 9
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as whole:
        whole.writestr("x/im0.png", content)
        whole.writestr("x/im1.png", content[::-1])
    raw = bytearray(made.getvalue())
    for at, value in changes:
        raw[at % len(raw)] = value
    path, target = tmp_path / "a.zip", tmp_path / "out"
    path.write_bytes(raw[: max(0, len(raw) - cut)] if cut < 40 else raw)
    with suppress(ArchiveError), opened(path) as damaged:
        for info in members(damaged, ["im0.png", "im1.png"]):
            target.unlink(missing_ok=True)
            unpack(damaged, info, target, MEBI)
    assert {path.name for path in tmp_path.iterdir()} <= {"a.zip", "out"}
